(() => {
  const { columns, links } = data;
  const count = columns.length ? columns[0].values.length : 0;
  const numbers = columns.filter((column) => column.numeric && column.name !== data.case);
  const label = (column) => (column.unit ? `${column.name} [${column.unit}]` : column.name);
  const named = (name) => columns.find((column) => column.name === name);
  const text = (value) => (typeof value === "number" ? short(value) : value ?? "");
  const caseOf = (row) => named(data.case)?.values[row] ?? row + 1;

  // --- scales -----------------------------------------------------------------------------------------------------
  for (const column of numbers) {
    const positive = column.values.every((value) => value === null || value > 0);
    column.ends = extent([column.values]);
    column.wide = positive && column.ends[1] >= 100 * column.ends[0];
  }
  /** From the numbers of a column to places from `a` to `b`; NaN for what has none. */
  const scale = ([low, high], log, a, b) => {
    const f = log ? Math.log10 : (x) => x;
    const place = (value) => (value === null || (log && value <= 0) ? NaN : a + ((f(value) - f(low)) / (f(high) - f(low))) * (b - a));
    const inverse = (at) => { const x = f(low) + ((at - a) / (b - a)) * (f(high) - f(low)); return log ? 10 ** x : x; };
    return { place, inverse };
  };
  const marks = ([low, high], log, most) => {
    if (!log) return ticks(low, high, most);
    const decades = [];
    for (let i = Math.floor(Math.log10(low)); i <= Math.log10(high); i += 1) decades.push(10 ** i);
    const digits = decades.length <= most / 2 ? [1, 2, 5] : [1];
    return decades.flatMap((decade) => digits.map((digit) => digit * decade)).filter((x) => x >= low * 0.999 && x <= high * 1.001);
  };
  const STOPS = [[102, 72, 170], [45, 130, 180], [53, 170, 115], [230, 160, 30]];
  const colour = (share) => {
    const place = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
    const stop = Math.min(Math.floor(place), STOPS.length - 2);
    return `rgb(${STOPS[stop].map((part, i) => Math.round(part + (place - stop) * (STOPS[stop + 1][i] - part)))})`;
  };
  const theme = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  /** A context whose unit is a pixel of the page, and its size. */
  const prepare = (canvas) => {
    const [width, height, ratio] = [canvas.clientWidth, canvas.clientHeight, window.devicePixelRatio || 1];
    [canvas.width, canvas.height] = [width * ratio, height * ratio];
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    context.font = "12px system-ui, sans-serif";
    return { context, width, height };
  };

  // --- what is chosen ---------------------------------------------------------------------------------------------
  const brushes = new Map();
  let chosen = [];
  const choose = () => {
    chosen = [];
    for (let row = 0; row < count; row += 1) {
      let fits = true;
      for (const [column, [low, high]] of brushes) {
        const value = column.values[row];
        fits &&= value !== null && value >= low && value <= high;
      }
      if (fits) chosen.push(row);
    }
    get("shown").textContent = chosen.length === count ? `${count} cases` : `${chosen.length} of ${count} cases`;
    get("all").hidden = brushes.size === 0;
    document.body.dataset.chosen = chosen.length;
  };
  const colours = () => {
    const column = numbers[get("colour").value];
    const { place } = column ? scale(column.ends, column.wide, 0, 1) : {};
    return (row) => {
      const share = column ? place(column.values[row]) : NaN;
      return column && !Number.isFinite(share) ? theme("--faint") : column ? colour(share) : COLOURS[0];
    };
  };

  // --- one case a point, or a cell of a map -------------------------------------------------------------------------
  let points = [];
  /** The chosen cases as a map, if they are all combinations of the values of two columns. */
  const grid = (x, y) => {
    const order = ({ values }) => [...new Set(chosen.map((row) => values[row]))].filter((value) => value !== null).sort((a, b) => a - b);
    const [xs, ys] = [x, y].map(order);
    const key = (a, b) => `${a} ${b}`;
    const rows = new Map(chosen.map((row) => [key(x.values[row], y.values[row]), row]));
    const isFull = Math.min(xs.length, ys.length) > 1 && [chosen.length, xs.length * ys.length].every((number) => number === rows.size);
    return isFull ? { xs, ys, row: (i, j) => rows.get(key(xs[i], ys[j])) } : null;
  };
  /** Pieces of the line on which a number is 1, between four neighbours [x, y, number]. */
  const contour = (corners) => {
    const ends = corners.flatMap(([ax, ay, a], i) => {
      const [bx, by, b] = corners[(i + 1) % 4];
      const share = (1 - a) / (b - a);
      return a === null || b === null || a < 1 === b < 1 ? [] : [[ax + share * (bx - ax), ay + share * (by - ay)]];
    });
    return ends.length % 2 ? [] : [ends.slice(0, 2), ends.slice(2)].filter((piece) => piece.length);
  };
  const isRatio = (column) => /(yield_|tensile_|\.)ratio$/.test(column?.name);
  /** Cells of a map, and of a ratio of stress to strength where it is 1; numbers of both. */
  const drawMap = ({ xs, ys, row }, column, paint, across, up, [left, right, top, bottom], context) => {
    const edges = (values, place, first, last) => [first, ...values.slice(1).map((value, i) => (place(values[i]) + place(value)) / 2), last];
    const [columns, rows] = [edges(xs, across.place, left, right), edges(ys, up.place, bottom, top)];
    const pairs = (width, height) => Array.from({ length: width * height }, (_, n) => [n % width, Math.floor(n / width)]);
    for (const [i, j] of pairs(xs.length, ys.length)) {
      context.fillStyle = paint(row(i, j));
      context.fillRect(columns[i], rows[j + 1], columns[i + 1] - columns[i], rows[j] - rows[j + 1]);
    }
    if (!isRatio(column)) return [xs.length * ys.length, 0];
    const corner = (i, j) => [across.place(xs[i]), up.place(ys[j]), column.values[row(i, j)]];
    const pieces = pairs(xs.length - 1, ys.length - 1).flatMap(([i, j]) => contour([corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]));
    for (const [colour, width] of [[theme("--card"), 5], [theme("--ink"), 2]]) {
      [context.strokeStyle, context.lineWidth] = [colour, width];
      context.beginPath();
      for (const [from, to] of pieces) { context.moveTo(...from); context.lineTo(...to); }
      context.stroke();
    }
    return [xs.length * ys.length, pieces.length];
  };
  const drawScatter = () => {
    const { context, width, height } = prepare(document.querySelector("#scatter canvas"));
    const [left, right, top, bottom] = [64, 14, 10, 44];
    const [x, y] = ["x", "y"].map((id) => numbers[get(id).value]);
    const side = (column, log, a, b) => {
      const shown = log ? column.values.filter((value) => value > 0) : column.values;
      let [low, high] = extent([shown]);
      if (log && low <= 0) [low, high] = [high / 2, 2 * high];
      const edge = log ? (high / low) ** 0.03 : 0.03 * (high - low);
      const ends = log ? [low / edge, high * edge] : [low - edge, high + edge];
      return { ends, log, ...scale(ends, log, a, b) };
    };
    const across = side(x, get("log-x").checked, left, width - right);
    const up = side(y, get("log-y").checked, height - bottom, top);
    context.fillStyle = theme("--ink");
    context.strokeStyle = theme("--line");
    const line = (...ends) => { context.beginPath(); context.moveTo(ends[0], ends[1]); context.lineTo(ends[2], ends[3]); context.stroke(); };
    context.textAlign = "center";
    for (const value of marks(across.ends, across.log, width / 90)) {
      line(across.place(value), top, across.place(value), height - bottom);
      context.fillText(short(value), across.place(value), height - bottom + 16);
    }
    context.fillText(label(x), (left + width - right) / 2, height - 8);
    context.textAlign = "right";
    for (const value of marks(up.ends, up.log, height / 50)) {
      line(left, up.place(value), width - right, up.place(value));
      context.fillText(short(value), left - 6, up.place(value) + 4);
    }
    context.save();
    context.translate(13, (top + height - bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText(label(y), 0, 0);
    context.restore();
    const paint = colours();
    const size = chosen.length > 3000 ? 2 : 3;
    points = [];
    const column = numbers[get("colour").value];
    const map = column && grid(x, y);
    const [cells, pieces] = map ? drawMap(map, column, paint, across, up, [left, width - right, top, height - bottom], context) : [0, 0];
    document.querySelector("#scatter figcaption").textContent = `One case a ${map ? "cell" : "point"}${pieces ? "; the line: stress is as large as strength" : ""}`;
    context.globalAlpha = 0.8;
    for (const row of chosen) {
      const [px, py] = [across.place(x.values[row]), up.place(y.values[row])];
      if (!Number.isFinite(px + py)) continue;
      points.push([px, py, row]);
      if (map) continue;
      context.fillStyle = paint(row);
      context.beginPath();
      context.arc(px, py, size, 0, 2 * Math.PI);
      context.fill();
    }
    Object.assign(document.body.dataset, { points: points.length, cells, pieces });
  };
  const showPoint = (event) => {
    const REACH = 14;
    let [best, found] = [REACH ** 2, null];
    for (const [px, py, row] of points) {
      const distance = (px - event.offsetX) ** 2 + (py - event.offsetY) ** 2;
      if (distance < best) [best, found] = [distance, row];
    }
    const values = ["x", "y", "colour"].map((id) => numbers[get(id).value]).filter(Boolean);
    const say = (column) => `${column.name} = ${text(column.values[found])}${column.unit ? ` ${column.unit}` : ""}`;
    get("point").textContent = found === null ? "" : `case ${caseOf(found)}: ${values.map(say).join(", ")}`;
  };

  // --- one case a line --------------------------------------------------------------------------------------------
  const STEP = 78;
  const [TOP, BOTTOM, LEFT, RIGHT] = [110, 14, 40, 90];
  const faint = document.createElement("canvas");
  let axes = [];
  const lines = (context, rows, paint) => {
    for (const row of rows) {
      context.strokeStyle = paint(row);
      context.beginPath();
      let pen = false;
      for (const axis of axes) {
        const y = axis.place(axis.column.values[row]);
        if (!Number.isFinite(y)) { pen = false; continue; }
        if (pen) context.lineTo(axis.x, y); else context.moveTo(axis.x, y);
        pen = true;
      }
      context.stroke();
    }
  };
  const strength = (rows) => Math.min(0.8, Math.max(0.04, 60 / rows.length));
  /** Sizes, axes and the lines of all cases, which stay behind those that are chosen. */
  const layOut = () => {
    const canvas = document.querySelector("#parallel canvas");
    canvas.style.width = `${Math.max(canvas.parentNode.clientWidth, STEP * numbers.length)}px`;
    const { width, height } = prepare(canvas);
    const step = (width - LEFT - RIGHT) / Math.max(1, numbers.length - 1);
    axes = numbers.map((column, i) => ({ column, x: LEFT + i * step, ...scale(column.ends, column.wide, height - BOTTOM, TOP) }));
    [faint.width, faint.height] = [canvas.width, canvas.height];
    const context = faint.getContext("2d");
    context.scale(canvas.width / width, canvas.width / width);
    context.globalAlpha = strength(columns[0].values);
    const faintest = theme("--cursor");
    lines(context, columns[0].values.keys(), () => faintest);
  };
  const drawParallel = () => {
    const { context, width, height } = prepare(document.querySelector("#parallel canvas"));
    if (brushes.size) context.drawImage(faint, 0, 0, width, height);
    context.globalAlpha = strength(chosen);
    lines(context, chosen, colours());
    context.globalAlpha = 1;
    for (const { column, x, place } of axes) {
      context.strokeStyle = context.fillStyle = theme("--ink");
      context.beginPath();
      context.moveTo(x, TOP);
      context.lineTo(x, height - BOTTOM);
      context.stroke();
      context.lineWidth = 3;
      context.strokeStyle = theme("--card");
      for (const value of marks(column.ends, column.wide, 5)) {
        context.strokeText(short(value), x + 4, place(value) + 4);
        context.fillText(short(value), x + 4, place(value) + 4);
      }
      context.lineWidth = 1;
      context.save();
      context.translate(x, TOP - 8);
      context.rotate(-Math.PI / 5);
      context.fillText(label(column), 0, 0);
      context.restore();
      const brush = brushes.get(column);
      if (!brush) continue;
      const [low, high] = brush.map(place);
      context.fillStyle = COLOURS[1];
      context.globalAlpha = 0.35;
      context.fillRect(x - 8, high, 16, Math.max(2, low - high));
      context.globalAlpha = 1;
    }
  };
  const brush = (canvas) => {
    let [axis, start] = [null, 0];
    canvas.addEventListener("pointerdown", (event) => {
      const away = (other) => Math.abs(other.x - event.offsetX);
      axis = axes.reduce((best, other) => (away(other) < away(best) ? other : best));
      start = event.offsetY;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!axis) return;
      const [low, high] = axis.column.ends;
      const ends = [start, event.offsetY].map(axis.inverse).map((value) => Math.min(Math.max(value, low), high));
      brushes.set(axis.column, ends.sort((a, b) => a - b));
      change();
    });
    const end = (event) => {
      const CLICK = 4;
      if (axis && Math.abs(event.offsetY - start) < CLICK) { brushes.delete(axis.column); change(); }
      axis = null;
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
  };

  // --- the table: of its many rows only those in sight ----------------------------------------------------------------
  const ROW = 28;
  const table = document.querySelector("#cases table");
  const frame = table.parentNode;
  const sorted = { column: null, down: false };
  let order = [];
  const sort = () => {
    order = chosen.slice();
    if (!sorted.column) return;
    const { values } = sorted.column;
    const sign = sorted.down ? -1 : 1;
    const compare = (a, b) => (a < b ? -sign : a > b ? sign : 0);
    // what is empty stays at the end
    order.sort((a, b) => (values[a] === null) - (values[b] === null) || compare(values[a], values[b]) || a - b);
  };
  const fillTable = () => {
    const first = Math.max(0, Math.floor(frame.scrollTop / ROW) - 10);
    const last = Math.min(order.length, first + Math.ceil(frame.clientHeight / ROW) + 20);
    const space = (rows) => {
      const row = make("tr", { class: "space" });
      const cell = make("td");
      cell.style.height = `${rows * ROW}px`;
      row.append(cell);
      return rows ? [row] : [];
    };
    const rows = order.slice(first, last).map((row) => {
      const node = make("tr");
      for (const column of columns) {
        const cell = make("td", { title: text(column.values[row]) });
        const link = column.name === data.case && links[row];
        cell.append(link ? make("a", { href: link }, text(column.values[row])) : text(column.values[row]));
        node.append(cell);
      }
      return node;
    });
    table.tBodies[0].replaceChildren(...space(first), ...rows, ...space(order.length - last));
  };
  let width = 0;
  for (const column of columns) {
    const [SHORTEST, LONGEST] = [6, 32];
    // long names are broken behind points and lines
    const parts = label(column).split(/(?<=[._ ])/);
    const lengths = [...parts, ...column.values.map(text)].map((part) => String(part).length);
    const own = Math.min(LONGEST, lengths.reduce((most, length) => Math.max(most, length), SHORTEST)) + 2;
    const col = make("col");
    col.style.width = `${own}ch`;
    width += own;
    table.querySelector("colgroup").append(col);
    const head = make("th", { scope: "col" });
    const button = make("button", { type: "button" });
    button.append(...parts.flatMap((part) => [part, make("wbr")]));
    button.addEventListener("click", () => {
      sorted.down = sorted.column === column && !sorted.down;
      sorted.column = column;
      for (const other of table.querySelectorAll("th")) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", sorted.down ? "descending" : "ascending");
      frame.scrollTop = 0;
      sort();
      fillTable();
    });
    head.append(button);
    table.querySelector("thead tr").append(head);
  }
  table.style.width = `${width}ch`;
  let waits = false;
  const soon = (work) => {
    if (waits) return;
    waits = true;
    requestAnimationFrame(() => { waits = false; work(); });
  };
  frame.addEventListener("scroll", () => soon(fillTable));

  // --- words and choices ------------------------------------------------------------------------------------------
  get("title").textContent = data.title;
  const counts = (names) => {
    const found = new Map();
    for (const name of names) found.set(name, (found.get(name) ?? 0) + 1);
    return found;
  };
  for (const [state, cases] of counts(named(data.status)?.values ?? []))
    get("verdict").append(make("li", { class: state === "failed" ? "bad" : "good" }, `${cases} ${text(state)}`));
  const warnings = (named(data.warnings)?.values ?? []).flatMap((value) => text(value).split(";").filter(Boolean));
  for (const [about, cases] of counts(warnings))
    get("verdict").append(make("li", { class: "bad" }, `warning: ${about} in ${cases}`));
  if (data.uncertainty?.[0]?.length) {
    get("uncertainty").hidden = false;
    const [names, units, ...rest] = data.uncertainty;
    names.forEach((name, row) => {
      const cells = [units[row] ? `${name} [${units[row]}]` : name, ...rest.map((column) => text(column[row]))];
      const line = make("tr");
      line.append(...cells.map((cell) => make("td", {}, cell)));
      document.querySelector("#uncertainty tbody").append(line);
    });
  }
  const redraw = () => {
    if (numbers.length) { drawScatter(); drawParallel(); }
    sort();
    fillTable();
  };
  const change = () => soon(() => { choose(); redraw(); });
  get("all").addEventListener("click", () => { brushes.clear(); change(); });
  choose();
  if (numbers.length) {
    // parameters stand before the status, measures behind it
    const status = columns.indexOf(named(data.status));
    const varied = numbers.filter((column) => columns.indexOf(column) < status);
    const measured = numbers.filter((column) => columns.indexOf(column) > status);
    const isMap = varied.length === 2 && grid(...varied);
    const start = isMap
      ? { x: varied[0], y: varied[1], colour: measured.find(isRatio) ?? measured[0] }
      : { x: varied[0] ?? numbers[0], y: measured[0] ?? numbers[1] ?? numbers[0], colour: varied[1] };
    get("colour").append(make("option", { value: "" }, "none"));
    for (const id of ["x", "y", "colour"]) {
      numbers.forEach((column, i) => get(id).append(make("option", { value: i }, label(column))));
      get(id).value = start[id] ? numbers.indexOf(start[id]) : "";
      get(id).addEventListener("change", () => { suit(id); change(); });
    }
    const suit = (id) => {
      const column = numbers[get(id).value];
      if (id !== "colour") { get(`log-${id}`).checked = column.wide; return; }
      get("scale").hidden = !column;
      const [low, bar, high] = get("scale").children;
      bar.style.background = `linear-gradient(to right, ${STOPS.map((stop) => `rgb(${stop})`)})`;
      [low.textContent, high.textContent] = (column?.ends ?? []).map((x) => short(x));
    };
    for (const id of ["x", "y", "colour"]) suit(id);
    for (const id of ["log-x", "log-y"]) get(id).addEventListener("change", change);
    document.querySelector("#scatter canvas").addEventListener("pointermove", showPoint);
    brush(document.querySelector("#parallel canvas"));
    const again = () => { layOut(); redraw(); };
    new ResizeObserver(() => soon(again)).observe(document.body);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
    again();
  } else {
    get("scatter").remove();
    get("parallel").remove();
    redraw();
  }
  document.body.dataset.ready = "true";
})();
