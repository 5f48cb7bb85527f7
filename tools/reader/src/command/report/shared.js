"use strict";
// What the scripts of all reports share.
const data = JSON.parse(document.getElementById("data").textContent);
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9", "#999999"];
const get = (id) => document.getElementById(id);
const make = (name, attributes = {}, text) => {
  const svg = ["svg", "g", "path", "line", "text", "clipPath", "rect"].includes(name);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
};
const short = (x, digits = 5) => (x === null || !Number.isFinite(x) ? "–" : String(Number(x.toPrecision(digits))));

// --- axes -------------------------------------------------------------------------------------------------------
const ticks = (low, high, count) => {
  const raw = (high - low) / count;
  const decade = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((digit) => digit * decade).find((size) => size >= raw);
  const list = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1) list.push(i * step);
  return list;
};
const extent = (lists) => {
  let [low, high] = [Infinity, -Infinity];
  for (const list of lists) for (const x of list) if (x !== null) { low = Math.min(low, x); high = Math.max(high, x); }
  if (!(low <= high)) return [0, 1];
  return low === high ? [low - 0.5, high + 0.5] : [low, high];
};
