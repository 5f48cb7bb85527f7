(() => {
  // --- what follows the time --------------------------------------------------------------------------------------
  const followers = [];
  for (const spec of data.charts) {
    const figure = make("figure", { id: `chart-${spec.id}` });
    figure.append(make("figcaption", {}, spec.title));
    get("charts").append(figure);
    const colours = spec.curves.map((_, i) => COLOURS[i % COLOURS.length]);
    const axes = chart(figure, { title: spec.title, x: spec.x, y: spec.y, xs: extent(spec.curves.map((c) => c.x)), ys: extent(spec.curves.map((c) => c.y)), colours });
    axes.curves(spec.curves);
    const legend = make("ul", { class: "legend" });
    const values = spec.curves.map((curve, i) => {
      const item = make("li");
      const swatch = make("i");
      swatch.style.background = colours[i];
      const value = make("span");
      item.append(swatch, `${curve.name}: `, value);
      legend.append(item);
      return value;
    });
    figure.append(legend);
    followers.push((time) => {
      axes.cursor(time);
      spec.curves.forEach((curve, i) => { values[i].textContent = four(curve.y[nearest(curve.x, time)]) + suffix(spec.unit); });
    });
  }

  const profiles = data.profiles;
  const profileTimes = profiles ? profiles.frames.map((frame) => frame.time) : [];
  if (profileTimes.length) {
    const figure = get("profile");
    const title = "Interface stress along the surface";
    figure.firstElementChild.textContent = title;
    const axes = chart(figure, { title, x: profiles.x, y: profiles.y, height: 260, xs: extent([[0], ...profiles.frames.map((f) => f.x)]), ys: extent(profiles.frames.map((f) => f.y)), colours: [COLOURS[0]] });
    followers.push((time) => {
      const frame = profiles.frames[nearest(profileTimes, time)];
      axes.curves([frame]);
      figure.dataset.time = frame.time;
    });
  } else get("profile").remove();

  const field = data.field;
  if (field && field.times.length) followers.push(section(get("field"), field));
  else get("field").remove();

  // --- words ------------------------------------------------------------------------------------------------------
  const rows = (id, entries) => {
    const table = get(id);
    for (const [key, value] of entries) {
      const row = make("tr");
      row.append(make("th", { scope: "row" }, key), make("td", {}, value));
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
  const residual = last("residual");
  if (residual !== null) {
    const whole = Math.max(...["kinetic", "strain", "indenter", "dissipated", "damped", "work"].map((name) => Math.abs(last(name) ?? 0)));
    badge(`energy balance to ${Math.abs(residual / (whole || 1)).toExponential(0)}`, Math.abs(residual) <= 1e-9 * whole);
  }
  const series = (name) => (energy && (energy.curves.find((entry) => entry.name === name) || {}).y) || [];
  const [kinetic, strain, indenter, dissipated, damped, work] = ["kinetic", "strain", "indenter", "dissipated", "damped", "work"].map(series);
  if (kinetic.length) {
    // what the run began with and was given; neither waves nor what is taken from them can have more
    const given = kinetic.map((value, i) => value + strain[i] + (indenter[i] || 0) + (dissipated[i] || 0) + (damped[i] || 0));
    const [most, slack] = [Math.max(...given), 0.01 * Math.max(...kinetic)];
    const exceeds = kinetic.some((value, i) => Math.max(value, value + strain[i]) > most + slack);
    const falls = damped.some((value, i) => value < (i ? damped[i - 1] : 0) - slack);
    badge(exceeds ? "the target has more energy than was brought in" : "the target never has more energy than was brought in", !exceeds);
    if (falls) badge("the energy taken out by damping falls", false);
  }
  for (const event of data.events.filter((entry) => entry.warns)) badge(event.text, false);
  rows("results", data.facts.results);
  rows("run", data.facts.run);
  rows("ledger", data.facts.energy);
  rows("events", data.events.map((event) => [`t = ${four(event.time)}${suffix(data.time_unit)}`, event.text]));
  for (const record of ["run", "validity", "host", "status"])
    for (const [key, value] of Object.entries(data[record] || {})) get("records").append(`percuss.${record}  ${key} = ${value}\n`);
  get("case").textContent = data.case || "not recorded";
  get("checks").textContent = data.verdict;

  // --- the time: frames of the field, else of the profile, else even steps ----------------------------------------
  const [begin, end] = extent(data.charts.flatMap((spec) => spec.curves.map((curve) => curve.x)));
  const recorded = field && field.times.length ? field.times : profileTimes;
  const times = recorded.length > 1 ? recorded : Array.from({ length: 201 }, (_, i) => begin + (i / 200) * (end - begin));
  const [slider, play] = [get("time"), get("play")];
  slider.max = times.length - 1;
  const show = () => {
    const time = times[Number(slider.value)];
    const text = `t = ${four(time)}${suffix(data.time_unit)}`;
    get("now").textContent = text;
    slider.setAttribute("aria-valuetext", `${text}, frame ${Number(slider.value) + 1} of ${times.length}`);
    for (const follow of followers) follow(time);
  };
  const go = (frame) => {
    slider.value = Math.min(Math.max(frame, 0), times.length - 1);
    show();
  };
  let playing = null;
  const stop = () => { cancelAnimationFrame(playing); playing = null; play.textContent = "play"; };
  const toggle = () => {
    if (playing !== null) { stop(); return; }
    const SECONDS = 10;
    let [from, start] = [Number(slider.value), null];
    if (from >= times.length - 1) from = 0;
    const tick = (now) => {
      start ??= now;
      const frame = Math.floor(from + ((now - start) / (1000 * SECONDS)) * (times.length - 1));
      if (frame !== Number(slider.value)) go(frame);
      if (frame >= times.length - 1) stop(); else playing = requestAnimationFrame(tick);
    };
    play.textContent = "pause";
    playing = requestAnimationFrame(tick);
  };
  slider.addEventListener("input", show);
  play.addEventListener("click", toggle);
  // keys of the page where nothing that has them itself is focused: the slider steps by the arrow keys of the browser
  const STEPS = { ArrowLeft: -1, ArrowRight: 1 };
  document.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
    const has = (kinds) => event.target.closest && event.target.closest(kinds);
    if (event.key === " " && !has("button, summary")) toggle();
    else if (event.key in STEPS && !has("input, pre")) { stop(); go(Number(slider.value) + STEPS[event.key]); } else return;
    event.preventDefault();
  });
  // a printed page is one still frame
  window.addEventListener("beforeprint", stop);
  go(Math.round(0.4 * (times.length - 1)));
  document.body.dataset.ready = "true";
})();
