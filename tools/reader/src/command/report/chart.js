// Axes with curves, drawn in the width that the page has: text keeps its size, and there are as many ticks as have room.
const four = (x) => short(x, 4);
/** Calls `draw` with the width of an element, now and whenever it changes. */
const fitted = (element, draw) => {
  let known = 0;
  const fit = (width) => { if (width > 0 && width !== known) { known = width; draw(width); } };
  fit(Math.floor(element.clientWidth));
  new ResizeObserver(() => fit(Math.floor(element.clientWidth))).observe(element);
};
/** Width of a label in an SVG of the page, about. */
const extentOf = (text) => 6.6 * text.length;
/** Draws axes into a box of a figure and keeps them as wide as it; answers with a function for new curves and one for the cursor. */
const chart = (figure, { title, x, y, height = 230, xs, ys, colours }) => {
  const box = make("div", { class: "plot" });
  figure.append(box);
  const state = { curves: [], cursor: null };
  const margin = 0.05 * (ys[1] - ys[0]);
  const [y0, y1] = [ys[0] - margin, ys[1] + margin];
  const rows = ticks(y0, y1, 5);
  const [right, top, bottom] = [16, 26, 40];
  const left = 10 + Math.max(18, ...rows.map((value) => extentOf(short(value))));
  let lines = () => {};
  fitted(box, (width) => {
    const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${title}: ${y} against ${x}` });
    const px = (value) => left + ((value - xs[0]) / (xs[1] - xs[0])) * (width - left - right);
    const py = (value) => height - bottom - ((value - y0) / (y1 - y0)) * (height - top - bottom);
    // no more ticks than have room for their labels
    let columns = ticks(xs[0], xs[1], Math.max(2, Math.floor((width - left - right) / 70)));
    const widest = Math.max(...columns.map((value) => extentOf(short(value)))) + 10;
    while (columns.length > 2 && px(columns[1]) - px(columns[0]) < widest) columns = columns.filter((_, i) => i % 2 === 0);
    for (const value of columns) {
      svg.append(make("line", { class: "grid", x1: px(value), x2: px(value), y1: top, y2: height - bottom }));
      svg.append(make("text", { x: px(value), y: height - bottom + 15, "text-anchor": "middle" }, short(value)));
    }
    for (const value of rows) {
      svg.append(make("line", { class: "grid", x1: left, x2: width - right, y1: py(value), y2: py(value) }));
      svg.append(make("text", { x: left - 6, y: py(value) + 4, "text-anchor": "end" }, short(value)));
    }
    svg.append(make("text", { class: "label", x: width - right, y: height - 6, "text-anchor": "end" }, x));
    svg.append(make("text", { class: "label", x: 4, y: 13 }, y));
    const path = (points) => {
      let [text, pen] = ["", "M"];
      points.x.forEach((value, i) => {
        if (points.y[i] === null) { pen = "M"; return; }
        text += `${pen}${px(value).toFixed(1)} ${py(points.y[i]).toFixed(1)}`;
        pen = "L";
      });
      return text;
    };
    const nodes = colours.map((colour) => make("path", { class: "curve", stroke: colour }));
    const cursor = make("line", { class: "cursor", y1: top, y2: height - bottom });
    svg.append(...nodes);
    lines = () => {
      state.curves.forEach((points, i) => nodes[i].setAttribute("d", path(points)));
      if (state.cursor === null) return;
      if (!cursor.parentNode) svg.append(cursor);
      cursor.setAttribute("x1", px(state.cursor));
      cursor.setAttribute("x2", px(state.cursor));
    };
    lines();
    box.replaceChildren(svg);
  });
  return {
    curves: (curves) => { state.curves = curves; lines(); },
    cursor: (value) => { state.cursor = value; lines(); },
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
