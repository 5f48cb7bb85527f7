// The section of the target under the indenter, at equal scales of r and z.
/** The colours of numbers, as words of pixels. */
const colours = (palette) => {
  const byte = (_, i) => (i % 4 < 3 ? palette.charCodeAt(i - (i >> 2)) : 255);
  return new Uint32Array(Uint8Array.from({ length: (palette.length / 3) * 4 }, byte).buffer);
};
/** Draws the field into its figure; answers with a function that shows a time. */
const section = (figure, field) => {
  const LARGEST = 460; // height of the picture [pixels]
  const [left, right, top, bottom] = [42, 14, 8, 40];
  const { depths, radii, r, height, is_cut } = field.body;
  const length = field.length_unit === "R" ? "" : suffix(field.length_unit);
  const words = colours(atob(field.palette));
  const canvas = figure.querySelector(".section canvas");
  const stage = figure.querySelector(".section");
  let [view, number, shown, state] = [field.views[0], 0, -1, null];

  const scale = figure.querySelector(".scale canvas");
  const [low, high] = figure.querySelectorAll(".scale span");
  [low.textContent, high.textContent] = [four(-field.range), `${four(field.range)}${suffix(field.unit)}`];
  const [first, end] = field.bar;
  [scale.width, scale.height] = [end - first + 1, 1];
  const bar = scale.getContext("2d").createImageData(scale.width, 1);
  new Uint32Array(bar.data.buffer).set(words.subarray(first, end + 1));
  scale.getContext("2d").putImageData(bar, 0, 0);

  /** The pixels of a frame, mirrored to r < 0. */
  const paint = () => {
    const { columns, rows } = view;
    [canvas.width, canvas.height] = [2 * columns, rows];
    const context = canvas.getContext("2d");
    const image = context.createImageData(2 * columns, rows);
    const pixels = new Uint32Array(image.data.buffer);
    const numbers = atob(view.frames[number]);
    for (let j = 0; j < rows; j += 1)
      for (let i = 0; i < columns; i += 1) {
        const word = words[numbers.charCodeAt(j * columns + i)];
        pixels[2 * columns * j + columns + i] = word;
        pixels[2 * columns * j + columns - 1 - i] = word;
      }
    context.putImageData(image, 0, 0);
    shown = number;
  };

  /** Lays out axes, layers, indenter and contact over the pixels. */
  const layout = (available) => {
    // an indenter that gives has a field too, from a negative depth on
    const [half, all, upper] = [view.columns * view.pixel, view.rows * view.pixel, view.top];
    const depth = all + upper;
    const last = height.length - 1;
    const air = upper < 0 ? -upper : height.length ? (is_cut ? 0.3 * depth : Math.min(0.3 * depth, Math.max(height[last] - Math.max(0, ...depths), 0.02 * depth))) : 0;
    const size = Math.min((available - left - right) / (2 * half), LARGEST / (depth + air));
    const [x0, y0] = [left + half * size, top + air * size];
    const [width, full] = [left + 2 * half * size + right, y0 + depth * size + bottom];
    const [px, py] = [(value) => x0 + value * size, (value) => y0 + value * size];
    stage.style.maxWidth = `${width}px`;
    stage.style.aspectRatio = `${width} / ${full}`;
    // in parts of the box, so that a page that is printed smaller keeps all of it together
    canvas.style.left = `${(100 * left) / width}%`;
    canvas.style.width = `${(200 * half * size) / width}%`;
    canvas.style.top = `${(100 * (y0 + upper * size)) / full}%`;
    canvas.style.height = `${(100 * all * size) / full}%`;
    const svg = make("svg", { viewBox: `0 0 ${width} ${full}`, role: "img" });
    svg.setAttribute("aria-label", `${figure.firstElementChild.textContent}: section with indenter and contact`);
    const count = (pixels, room) => Math.max(1, Math.floor(pixels / room));
    for (const value of ticks(-half, half, count(2 * half * size, 50))) {
      svg.append(make("line", { class: "tick", x1: px(value), x2: px(value), y1: py(depth), y2: py(depth) + 4 }));
      svg.append(make("text", { x: px(value), y: py(depth) + 18, "text-anchor": "middle" }, short(Math.abs(value))));
    }
    for (const value of ticks(upper, depth, count(all * size, 36))) {
      svg.append(make("line", { class: "tick", x1: left - 4, x2: left, y1: py(value), y2: py(value) }));
      svg.append(make("text", { x: left - 7, y: py(value) + 4, "text-anchor": "end" }, short(value)));
    }
    svg.append(make("text", { class: "label", x: width - right, y: full - 4, "text-anchor": "end" }, `r, z${length ? ` [${length.trim()}]` : ""}`));
    const clip = make("clipPath", { id: "inside" });
    clip.append(make("rect", { x: left, y: top, width: 2 * half * size, height: py(depth) - top }));
    const drawing = make("g", { "clip-path": "url(#inside)" });
    svg.append(clip, drawing);
    view.layers.forEach((layer, i) => {
      if (layer.to <= layer.from) return;
      if (i > 0) drawing.append(make("line", { class: "interface", x1: left, x2: px(half), y1: py(upper + layer.from * all), y2: py(upper + layer.from * all) }));
      const place = { class: "layer", x: px(half) - 5, y: py(upper + 0.5 * (layer.from + layer.to) * all) + 4, "text-anchor": "end" };
      // thin layers have no room for their names
      if ((layer.to - layer.from) * all * size > 13) drawing.append(make("text", place, layer.name));
    });
    drawing.append(make("line", { class: "surface", x1: left, x2: px(half), y1: y0, y2: y0 }));
    // filled above the target only: the field under it is not covered, however deep it is
    const above = make("clipPath", { id: "above" });
    above.append(make("rect", { x: left, y: top, width: 2 * half * size, height: y0 - top }));
    const filling = make("path", { class: "filling", "clip-path": "url(#above)" });
    const body = make("path", { class: "body" });
    const contact = make("path", { class: "contact" });
    drawing.append(...(upper < 0 ? [] : [above, filling]), body, contact);
    state = () => {
      const w = depths[number];
      if (height.length && w !== undefined && w !== null) {
        const points = r.map((radius, i) => [radius, w - height[i]]);
        const sides = points.concat([[r[last], -air - 20 / size]]);
        const corners = sides.slice().reverse().map(([x, y]) => [-x, y]).concat(sides);
        const outline = `M${corners.map(([x, y]) => `${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join("L")}Z`;
        for (const path of [filling, body]) path.setAttribute("d", outline);
      }
      const a = radii[number];
      contact.setAttribute("d", a > 0 ? `M${px(-a)} ${y0}H${px(a)}M${px(-a)} ${y0 - 6}v12M${px(a)} ${y0 - 6}v12` : "");
    };
    state();
    stage.querySelector("svg").replaceWith(svg);
  };

  const value = (list, name) => (list.length && list[number] !== null ? ` · ${name} ${four(list[number])}${length}` : "");
  const redraw = () => {
    if (shown !== number) paint();
    state();
    figure.dataset.time = field.times[number];
    figure.querySelector(".readout").textContent = `t = ${four(field.times[number])}${suffix(data.time_unit)}${value(radii, "contact radius")}${value(depths, "depth")}`;
  };
  const unit = field.unit ? ` [${field.unit}]` : "";
  figure.firstElementChild.textContent = `${field.name.split("/").pop()}${unit} in the section; red: compression, blue: tension`;
  fitted(figure.querySelector(".room"), (width) => { layout(width); redraw(); });
  const button = get("whole");
  if (field.views.length < 2) button.remove();
  button.addEventListener("click", () => {
    const whole = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", whole);
    view = field.views[whole ? 1 : 0];
    shown = -1;
    layout(figure.querySelector(".room").clientWidth);
    redraw();
  });
  return (time) => { number = nearest(field.times, time); redraw(); };
};
