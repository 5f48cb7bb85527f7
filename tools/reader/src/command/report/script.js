(() => {
  /** Axes in an SVG; answers with a function that draws curves and one that moves the cursor. */
  const chart = (figure, { x, y, width = 640, height = 260, xs, ys }) => {
    const [left, right, top, bottom] = [58, 12, 10, 40];
    const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, role: "img" });
    const margin = 0.05 * (ys[1] - ys[0]);
    const [y0, y1] = [ys[0] - margin, ys[1] + margin];
    const px = (value) => left + ((value - xs[0]) / (xs[1] - xs[0])) * (width - left - right);
    const py = (value) => height - bottom - ((value - y0) / (y1 - y0)) * (height - top - bottom);
    for (const value of ticks(xs[0], xs[1], 8)) {
      svg.append(make("line", { class: "grid", x1: px(value), x2: px(value), y1: top, y2: height - bottom }));
      svg.append(make("text", { x: px(value), y: height - bottom + 16, "text-anchor": "middle" }, short(value)));
    }
    for (const value of ticks(y0, y1, 5)) {
      svg.append(make("line", { class: "grid", x1: left, x2: width - right, y1: py(value), y2: py(value) }));
      svg.append(make("text", { x: left - 6, y: py(value) + 4, "text-anchor": "end" }, short(value)));
    }
    svg.append(make("text", { x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle" }, x));
    const middle = (top + height - bottom) / 2;
    svg.append(make("text", { x: 12, y: middle, "text-anchor": "middle", transform: `rotate(-90 12 ${middle})` }, y));
    figure.append(svg);
    const path = (points) => {
      let [text, pen] = ["", "M"];
      points.x.forEach((value, i) => {
        if (points.y[i] === null) { pen = "M"; return; }
        text += `${pen}${px(value).toFixed(1)} ${py(points.y[i]).toFixed(1)}`;
        pen = "L";
      });
      return text;
    };
    const cursor = make("line", { class: "cursor", y1: top, y2: height - bottom });
    return {
      curve: (colour) => {
        const node = make("path", { class: "curve", stroke: colour });
        svg.append(node);
        return (points) => node.setAttribute("d", path(points));
      },
      cursor: (value) => {
        if (!cursor.parentNode) svg.append(cursor);
        cursor.setAttribute("x1", px(value));
        cursor.setAttribute("x2", px(value));
      },
    };
  };
  /** Index of the last of rising numbers that is not above `value`. */
  const before = (list, value) => {
    let [low, high] = [0, list.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (list[middle] <= value) low = middle + 1; else high = middle;
    }
    return Math.max(0, low - 1);
  };
  /** Index of the number nearest to `value`. */
  const nearest = (list, value) => {
    const i = before(list, value);
    return i + 1 < list.length && list[i + 1] - value < value - list[i] ? i + 1 : i;
  };

  /** A unit behind a number: only those of SI are named, the others stand at the axes. */
  const suffix = (unit) => (unit ? ` ${unit}` : "");

  // --- what follows the time --------------------------------------------------------------------------------------
  const followers = [];
  for (const spec of data.charts) {
    const figure = make("figure", { id: `chart-${spec.id}` });
    figure.append(make("figcaption", {}, spec.title));
    get("charts").append(figure);
    const axes = chart(figure, { x: spec.x, y: spec.y, xs: extent(spec.curves.map((c) => c.x)), ys: extent(spec.curves.map((c) => c.y)) });
    const legend = make("ul", { class: "legend" });
    const values = spec.curves.map((curve, i) => {
      const colour = COLOURS[i % COLOURS.length];
      axes.curve(colour)(curve);
      const item = make("li");
      const swatch = make("i");
      swatch.style.background = colour;
      const value = make("span");
      item.append(swatch, `${curve.name}: `, value);
      legend.append(item);
      return value;
    });
    figure.append(legend);
    followers.push((time) => {
      axes.cursor(time);
      spec.curves.forEach((curve, i) => { values[i].textContent = short(curve.y[nearest(curve.x, time)]) + suffix(spec.unit); });
    });
  }

  const profiles = data.profiles;
  if (profiles && profiles.frames.length) {
    const figure = get("profile");
    figure.firstElementChild.textContent = "Interface stress along the surface";
    const axes = chart(figure, { x: profiles.x, y: profiles.y, width: 1200, height: 300, xs: extent([[0], ...profiles.frames.map((f) => f.x)]), ys: extent(profiles.frames.map((f) => f.y)) });
    const draw = axes.curve(COLOURS[0]);
    const times = profiles.frames.map((frame) => frame.time);
    followers.push((time) => {
      const frame = profiles.frames[nearest(times, time)];
      draw(frame);
      figure.dataset.time = frame.time;
    });
  } else get("profile").remove();

  // blue for tension, white for nothing, red for compression; one colour a level, transparent where there is no value
  const STOPS = [[18, 52, 120], [98, 160, 214], [247, 247, 247], [232, 128, 78], [120, 12, 32]];
  const palette = (field) => {
    const colours = new Uint8ClampedArray(256 * 4);
    for (let level = field.zero - field.side; level <= field.zero + field.side; level += 1) {
      const place = ((level - field.zero + field.side) / (2 * field.side)) * (STOPS.length - 1);
      const stop = Math.min(Math.floor(place), STOPS.length - 2);
      for (let part = 0; part < 3; part += 1)
        colours[4 * level + part] = STOPS[stop][part] + (place - stop) * (STOPS[stop + 1][part] - STOPS[stop][part]);
      colours[4 * level + 3] = 255;
    }
    return colours;
  };
  const field = data.field;
  if (field && field.frames.length) {
    const figure = get("field");
    const canvas = figure.querySelector("canvas");
    const colours = palette(field);
    const { columns, rows } = field;
    canvas.width = 2 * columns;
    canvas.height = rows;
    const context = canvas.getContext("2d");
    const image = context.createImageData(2 * columns, rows);
    const pixels = new Uint32Array(image.data.buffer);
    const words = new Uint32Array(colours.buffer);
    const unit = field.unit ? ` [${field.unit}]` : "";
    const length = field.length_unit === "R" ? "" : suffix(field.length_unit);
    figure.firstElementChild.textContent =
      `${field.name}${unit}, section to r = ±${short(field.width)}${length}, z = ${short(field.depth)}${length}; red: compression`;
    const [low, high] = figure.querySelectorAll(".scale span");
    [low.textContent, high.textContent] = [short(-field.range), short(field.range)];
    const bar = figure.querySelector(".scale canvas");
    [bar.width, bar.height] = [2 * field.side + 1, 1];
    const scale = bar.getContext("2d").createImageData(bar.width, 1);
    new Uint32Array(scale.data.buffer).set(words.subarray(field.zero - field.side, field.zero + field.side + 1));
    bar.getContext("2d").putImageData(scale, 0, 0);
    // the canvas keeps its proportions inside its box: the layers follow what is drawn of it
    const layers = figure.querySelector(".layers");
    layers.style.aspectRatio = `${2 * columns} / ${rows}`;
    layers.style.maxWidth = `calc(24rem * ${(2 * columns) / rows})`;
    field.layers.forEach((layer, i) => {
      const part = make("div");
      part.append(make("span", {}, layer.name));
      part.style.top = `${100 * layer.from}%`;
      part.style.height = `${100 * (layer.to - layer.from)}%`;
      if (i > 0) part.className = "interface";
      layers.append(part);
    });
    let shown = -1;
    followers.push((time) => {
      const frame = nearest(field.times, time);
      figure.dataset.time = field.times[frame];
      if (frame === shown) return;
      shown = frame;
      const levels = atob(field.frames[frame]);
      for (let j = 0; j < rows; j += 1)
        for (let i = 0; i < columns; i += 1) {
          const word = words[levels.charCodeAt(j * columns + i)];
          pixels[2 * columns * j + columns + i] = word;
          pixels[2 * columns * j + columns - 1 - i] = word;
        }
      context.putImageData(image, 0, 0);
    });
  } else get("field").remove();

  // --- words ------------------------------------------------------------------------------------------------------
  const rows = (id, entries) => {
    const table = get(id);
    for (const [key, value] of entries) {
      const row = make("tr");
      row.append(make("td", {}, key), make("td", {}, value));
      table.append(row);
    }
    if (!entries.length) table.parentNode.remove();
  };
  const status = data.status || {};
  get("title").textContent = data.title || data.file;
  get("subtitle").textContent = [data.file, `percuss ${data.run.percuss_version}`, data.host.start_time].filter(Boolean).join(" · ");
  const badge = (text, good) => get("verdict").append(make("li", { class: good ? "good" : "bad" }, text));
  badge(status.status ? `${status.status}: ${status.message}` : "no status: the run did not end", status.status === "completed" || status.status === "stopped");
  badge(data.sound ? "recording sound" : "recording NOT SOUND", data.sound);
  const energy = data.charts.find((spec) => spec.id === "energy");
  const last = (name) => {
    const curve = energy && energy.curves.find((entry) => entry.name === name);
    return curve ? curve.y[curve.y.length - 1] : null;
  };
  const parts = ["kinetic", "strain", "indenter", "dissipated", "damped", "work", "residual"].map((name) => [name, last(name)]);
  const residual = last("residual");
  if (residual !== null) {
    const whole = Math.max(...parts.slice(0, 6).map(([, value]) => Math.abs(value ?? 0)));
    badge(`energy balance to ${Math.abs(residual / (whole || 1)).toExponential(0)}`, Math.abs(residual) <= 1e-9 * whole);
  }
  for (const event of data.events.filter((entry) => entry.warns)) badge(event.text, false);
  rows("run", Object.entries(data.run));
  const legible = (text) => (text.length > 10 && Number.isFinite(Number(text)) ? short(Number(text)) : text);
  rows("validity", Object.entries(data.validity || {}).map(([key, value]) => [key, legible(value)]));
  rows("ledger", parts.filter(([, value]) => value !== null).map(([name, value]) => [name, short(value) + suffix(energy.unit)]));
  rows("events", data.events.map((event) => [`t = ${short(event.time)}${suffix(data.time_unit)}`, event.text]));
  get("case").textContent = data.case || "not recorded";
  get("checks").textContent = data.verdict;

  // --- the time ---------------------------------------------------------------------------------------------------
  const spans = data.charts.flatMap((spec) => spec.curves.map((curve) => curve.x)).concat(field ? [field.times] : []);
  const [begin, end] = extent(spans);
  const slider = get("time");
  const show = () => {
    const time = begin + (slider.value / slider.max) * (end - begin);
    get("now").textContent = `t = ${short(time)}${suffix(data.time_unit)}`;
    for (const follow of followers) follow(time);
  };
  slider.addEventListener("input", show);
  let playing = null;
  const stop = () => { cancelAnimationFrame(playing); playing = null; get("play").textContent = "play"; };
  get("play").addEventListener("click", () => {
    if (playing !== null) { stop(); return; }
    if (Number(slider.value) >= Number(slider.max)) slider.value = 0;
    const SECONDS = 10;
    let [from, start] = [Number(slider.value), null];
    const tick = (now) => {
      start ??= now;
      slider.value = from + ((now - start) / (1000 * SECONDS)) * slider.max;
      show();
      if (Number(slider.value) >= Number(slider.max)) stop(); else playing = requestAnimationFrame(tick);
    };
    get("play").textContent = "pause";
    playing = requestAnimationFrame(tick);
  });
  show();
  document.body.dataset.ready = "true";
})();
