"use strict";
// The one renderer of every page: a spec in, an SVG out.  It knows nothing of what it draws.
//
// A spec is { x, y, equal, layers }; an axis is { min, max, label, log, ticks: [[value, text]...] }
// (`ticks` in place of round numbers), and `equal` widens a range so that both axes have one scale.
// A layer is one of
//   { kind: "points", shape: "cross" | "diamond" | "dot", style, points: [[x, y, id]...], faint }
//   { kind: "line", style, points: [[x, y]...], dashed, width, faint }
//   { kind: "band", style, points: [[x, low, high]...] }
//   { kind: "arrows", style, arrows: [[x1, y1, x2, y2, id]...], width, faint, head }
//   { kind: "area", style, points: [[x, y]...], dashed }              a closed outline, lightly filled
//   { kind: "cells", style, cells: [[x0, y0, x1, y1, share]...] }     a density; share in [0, 1]
//   { kind: "text", style, points: [[x, y]], text, anchor, below }
// A style is the name of a colour of the page, "final" for --final.  On a log axis what is not
// above 0 is omitted.  A line of any length costs no more than four points a pixel.
// overlay(group, { box, toX, toY }) may draw more, in px: what has to stay where it is on the screen.

const MARK = { cross: 3, diamond: 3.6, dot: 2.4 };
const ROOM = { left: 62, top: 8, right: 12, bottom: 46 };  // px around the plotting area
const SVG_NAMESPACE = "http://www.w3.org/2000/svg";
const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

const isNumber = (v) => typeof v === "number" && Number.isFinite(v);

// Numbers for people: "1,230", "0.0412", "−3.2", "4.1 × 10⁻⁶"; never an exponent of a program.
function numberText(value, digits = 3) {
  if (!isNumber(value)) return "–";
  const size = Math.abs(value);
  let text;
  if (size >= 1000 && size < 1e15) {
    text = Math.round(Number(size.toPrecision(Math.max(digits, 4)))).toString().replace(/\B(?=(\d{3})+$)/g, ",");
  } else if (size && (size < 1e-4 || size >= 1e15)) {
    const power = Math.floor(Math.log10(size));
    const raised = [...String(power)].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c])).join("");
    text = `${Number((size / 10 ** power).toPrecision(digits))} × 10${raised}`;
  } else {
    text = Number(size.toPrecision(digits)).toString();
  }
  return (value < 0 && text !== "0" ? "−" : "") + text;
}

// "friction", "full_speed, m/s".
const withUnit = (text, unit, between = ", ") => (unit && unit !== "-" ? text + between + unit : text);

const colour = (style) => getComputedStyle(document.documentElement).getPropertyValue(`--${style}`).trim();

// At the end of `parent`.
function element(parent, name, properties = {}, text = "") {
  const made = parent.appendChild(Object.assign(document.createElement(name), properties));
  if (text) made.append(text);
  return made;
}

function svgElement(parent, name, attributes, text) {
  const element = document.createElementNS(SVG_NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return parent.appendChild(element);
}

// --- scales ---

const forward = (axis) => (axis.log ? Math.log10 : (v) => v);
const backward = (axis) => (axis.log ? (v) => 10 ** v : (v) => v);
const shown = (axis, v) => isNumber(v) && (!axis.log || v > 0);

function scaleOf(axis, from, to) {
  const f = forward(axis);
  const low = f(axis.min);
  const span = f(axis.max) - low;
  return {
    to: (v) => from + ((f(v) - low) / span) * (to - from),
    back: (px) => backward(axis)(low + ((px - from) / (to - from)) * span),
  };
}

// What the longest number beside the y axis takes, unless the spec states it.
function leftRoom({ y }, height) {
  const ticks = ticksOf(y, (height - ROOM.top - ROOM.bottom) / 36);
  return y.room || Math.max(ROOM.left, ...ticks.map(([, text]) => Math.round(24 + 6.8 * text.length)));
}

// The ranges of a chart of that size.
function fitted(spec, width, height) {
  if (!spec.equal) return spec;
  const room = leftRoom(spec, height);
  const inner = { x: width - room - ROOM.right, y: height - ROOM.top - ROOM.bottom };
  const unit = Math.max(...["x", "y"].map((k) => (spec[k].max - spec[k].min) / inner[k]));
  const around = (k) => {
    const middle = (spec[k].min + spec[k].max) / 2;
    const half = (unit * inner[k]) / 2;
    return { ...spec[k], min: middle - half, max: middle + half };
  };
  return { ...spec, x: around("x"), y: around("y"), room };
}

const within = ({ x, y }, [px, py]) => px >= x.min && px <= x.max && py >= y.min && py <= y.max;

const distinct = (numbers) => [...new Set(numbers)].sort((a, b) => a - b);
const extent = (values) => [Math.min(...values), Math.max(...values)];
const spaced = ({ min, max }, steps) => Array.from({ length: steps + 1 }, (_, i) => min + (i / steps) * (max - min));

// An axis from `min` to `max` with room at both ends, a share of its length.
function roomy(min, max, share) {
  const room = share * (max - min) || 0.05 * Math.abs(max) || 1;
  return { min: min - room, max: max + room };
}

// About `wanted` round numbers within [min, max].
function niceTicks(min, max, wanted) {
  if (!(max > min)) return [];
  const raw = (max - min) / Math.max(wanted, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
  const ticks = [];
  for (let i = Math.ceil(min / step - 1e-9); i * step <= max + 1e-9 * step; ++i) ticks.push(i * step);
  return ticks;
}

// Powers of ten, with 2 and 5 between them where there is room.
function logTicks(min, max, wanted) {
  const decades = Math.log10(max / min);
  if (decades < 0.7) return niceTicks(min, max, wanted);
  const factors = decades > wanted / 2 ? [1] : decades > wanted / 3 ? [1, 3] : [1, 2, 5];
  const each = Math.max(1, Math.ceil(decades / wanted));
  const ticks = [];
  for (let p = Math.floor(Math.log10(min)); p <= Math.log10(max); p += each) {
    for (const f of factors) if (f * 10 ** p >= min && f * 10 ** p <= max) ticks.push(f * 10 ** p);
  }
  return ticks;
}

function ticksOf(axis, wanted) {
  if (axis.ticks) return axis.ticks.filter(([v]) => v >= axis.min && v <= axis.max);
  const values = axis.log ? logTicks(axis.min, axis.max, wanted) : niceTicks(axis.min, axis.max, wanted);
  return values.map((v) => [v, numberText(v, 6)]);
}

// --- paths ---

const px = (v) => Math.round(v * 10) / 10;

function markPath(shape, x, y) {
  const r = MARK[shape];
  if (shape === "cross") return `M${px(x - r)} ${px(y - r)}l${2 * r} ${2 * r}m0 ${-2 * r}l${-2 * r} ${2 * r}`;
  if (shape === "diamond") return `M${x} ${px(y - r)}l${r} ${r}l${-r} ${r}l${-r} ${-r}Z`;
  return `M${px(x - r)} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
}

// Of every pixel's column the first, least, greatest and last point: what a screen can show.
function thinned(points, width) {
  if (points.length <= 4 * width) return points;
  const kept = [];
  const flush = (run) => {
    if (!run.length) return;
    let least = 0;
    let most = 0;
    run.forEach((p, i) => {
      if (p[1] < run[least][1]) least = i;
      if (p[1] > run[most][1]) most = i;
    });
    for (const i of [...new Set([0, Math.min(least, most), Math.max(least, most), run.length - 1])]) kept.push(run[i]);
  };
  let run = [];
  for (const p of points) {
    if (run.length && Math.floor(p[0]) !== Math.floor(run[0][0])) {
      flush(run);
      run = [];
    }
    run.push(p);
  }
  flush(run);
  return kept;
}

function polyline(points, closed) {
  let d = "";
  let pen = "M";
  for (const [x, y] of points) {
    if (!Number.isFinite(x) || !Number.isFinite(y)) {
      pen = "M";
      continue;
    }
    d += `${pen}${px(x)} ${px(y)}`;
    pen = "L";
  }
  return d + (closed && d ? "Z" : "");
}

function arrowPath([x1, y1, x2, y2], head) {
  const length = Math.hypot(x2 - x1, y2 - y1);
  let d = `M${px(x1)} ${px(y1)}L${px(x2)} ${px(y2)}`;
  const size = Math.min(head, length * 0.6);
  if (size < 1.5) return d;
  const angle = Math.atan2(y2 - y1, x2 - x1);
  for (const side of [2.6, -2.6]) {
    d += `M${px(x2 + size * Math.cos(angle + side))} ${px(y2 + size * Math.sin(angle + side))}L${px(x2)} ${px(y2)}`;
  }
  return d;
}

function drawLayer(group, spec, layer, toX, toY, width) {
  const paint = colour(layer.style);
  const place = (points) =>
    points.map(([x, y]) => (shown(spec.x, x) && shown(spec.y, y) ? [toX(x), toY(y)] : [NaN, NaN]));
  const path = (d, paints) => d && svgElement(group, "path", { d, fill: "none", ...paints });
  const dash = layer.dashed ? { "stroke-dasharray": "6 4" } : {};
  const faint = layer.faint ? { opacity: layer.faint === true ? 0.5 : layer.faint } : {};
  switch (layer.kind) {
    case "points": {
      const inFrame = layer.points.filter((p) => shown(spec.x, p[0]) && shown(spec.y, p[1]) && within(spec, p));
      const d = inFrame.map((p) => markPath(layer.shape, px(toX(p[0])), px(toY(p[1])))).join("");
      const solid = layer.shape === "dot";
      return path(d, { ...(solid ? { fill: paint } : { stroke: paint, "stroke-width": 1.3 }), ...faint });
    }
    case "line":
      return path(polyline(thinned(place(layer.points), width)), { stroke: paint, "stroke-width": layer.width || 2, "stroke-linejoin": "round", ...dash, ...faint });
    case "band": {
      const upper = place(layer.points.map(([x, , high]) => [x, high]));
      const lower = place(layer.points.map(([x, low]) => [x, low]));
      const outline = [...thinned(lower, width), ...thinned(upper, width).reverse()].filter(([x]) => Number.isFinite(x));
      return path(polyline(outline, true), { fill: paint, opacity: 0.16 });
    }
    case "arrows": {
      const d = layer.arrows.filter((a) => a.slice(0, 4).every(isNumber))
        .map(([a, b, c, e]) => arrowPath([toX(a), toY(b), toX(c), toY(e)], layer.head ?? 5)).join("");
      return path(d, { stroke: paint, "stroke-width": layer.width || 1.2, ...faint });
    }
    case "area":
      return path(polyline(place(layer.points), true), { fill: paint, "fill-opacity": 0.12, stroke: paint, "stroke-width": 1.6, ...dash });
    case "cells":
      for (const [x0, y0, x1, y1, share] of layer.cells) {
        const [left, right, top, bottom] = [toX(x0), toX(x1), toY(y1), toY(y0)];
        svgElement(group, "rect", { x: px(left), y: px(top), width: px(right - left) + 0.3, height: px(bottom - top) + 0.3, fill: paint, opacity: px(10 * share) / 10 });
      }
      return null;
    default:
      for (const [x, y] of layer.points) {
        svgElement(group, "text", {
          x: px(toX(x)), y: px(toY(y)) + (layer.below ? 15 : -6), "text-anchor": layer.anchor || "start",
          fill: paint, "font-weight": 600, "font-size": 12, stroke: colour("card"), "stroke-width": 4, "paint-order": "stroke",
        }, layer.text);
      }
      return null;
  }
}

function drawAxes(svg, spec, box, toX, toY) {
  const grid = colour("grid");
  const quiet = { fill: colour("quiet"), "font-size": 12 };
  const line = (x1, y1, x2, y2) => svgElement(svg, "line", { x1: px(x1), y1: px(y1), x2: px(x2), y2: px(y2), stroke: grid, "stroke-width": 1 });
  for (const [v, text] of ticksOf(spec.x, (box.right - box.left) / 60)) {
    line(toX(v), box.top, toX(v), box.bottom);
    // A long number at the right end stays within the figure.
    const over = toX(v) + 3.6 * text.length > box.right + ROOM.right;
    svgElement(svg, "text", { x: px(over ? box.right + ROOM.right - 1 : toX(v)), y: box.bottom + 16, "text-anchor": over ? "end" : "middle", ...quiet }, text);
  }
  for (const [v, text] of ticksOf(spec.y, (box.bottom - box.top) / 36)) {
    line(box.left, toY(v), box.right, toY(v));
    svgElement(svg, "text", { x: box.left - 6, y: px(toY(v)) + 4, "text-anchor": "end", ...quiet }, text);
  }
  const middle = (box.top + box.bottom) / 2;
  svgElement(svg, "text", { x: (box.left + box.right) / 2, y: box.bottom + 34, "text-anchor": "middle", ...quiet }, spec.x.label);
  if (!spec.y.label) return;
  svgElement(svg, "text", { x: 12, y: middle, "text-anchor": "middle", transform: `rotate(-90 12 ${middle})`, ...quiet }, spec.y.label);
}

let clipCount = 0;

// Draws `spec` into `host`.  Gives the scales, their inverses and the plotting area, in px.
function drawPlot(host, spec, width, height) {
  const svg = svgElement(host, "svg", { class: "chart", viewBox: `0 0 ${width} ${height}`, width, height, "font-family": FONT });
  const box = { left: spec.room || leftRoom(spec, height), top: ROOM.top, right: width - ROOM.right, bottom: height - ROOM.bottom };
  const x = scaleOf(spec.x, box.left, box.right);
  const y = scaleOf(spec.y, box.bottom, box.top);
  drawAxes(svg, spec, box, x.to, y.to);
  const id = `clip-${++clipCount}`;
  svgElement(svgElement(svg, "clipPath", { id }), "rect",
    { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top });
  const group = svgElement(svg, "g", { "clip-path": `url(#${id})` });
  for (const layer of spec.layers) drawLayer(group, spec, layer, x.to, y.to, width);
  spec.overlay?.(group, { box, toX: x.to, toY: y.to });
  return { svg, box, toX: x.to, toY: y.to, fromX: x.back, fromY: y.back };
}

// Limits around `values` that a few wild ones do not stretch: the quartiles widened by three times
// their distance, but no farther than the values go, and never without `always`.
function robustLimits(values, always = [], margin = 0.07) {
  const sorted = values.filter(isNumber).sort((a, b) => a - b);
  const kept = always.filter(isNumber);
  if (!sorted.length && !kept.length) return { min: -1, max: 1 };
  let [min, max] = [Infinity, -Infinity];
  if (sorted.length) {
    const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
    const reach = 3 * (at(0.75) - at(0.25)) || 3 * (at(0.95) - at(0.05)) || sorted.at(-1) - sorted[0];
    [min, max] = [Math.max(sorted[0], at(0.25) - reach), Math.min(sorted.at(-1), at(0.75) + reach)];
  }
  min = kept.reduce((a, b) => Math.min(a, b), min);
  max = kept.reduce((a, b) => Math.max(a, b), max);
  return roomy(min, max, margin);
}
