"use strict";
// One chart: layers of marks over two axes, drawn by uPlot on a canvas, or as SVG where the page
// was built without it.  Both draw the same paths.
//
// A spec is { x: {min, max, label}, y: {min, max, label}, equal, layers, describe }; `equal` widens a
// range so that both axes have one scale.  A layer is
//   { kind: "points", shape: "cross" | "diamond" | "dot", style, points: [[x, y, id]...], faint }
//   { kind: "line", style, points: [[x, y]...], dashed, width }
//   { kind: "text", style, points: [[x, y]], text, anchor: "start" | "middle" | "end", below }
// where style is "measured", "tuned", "final" or "quiet", and describe(id) is a sentence.

const MARK = { cross: 3, diamond: 3.6, dot: 2.4 };

function markPath(shape, x, y, scale) {
  const r = MARK[shape] * scale;
  if (shape === "cross") {
    return `M${x - r} ${y - r}L${x + r} ${y + r}M${x + r} ${y - r}L${x - r} ${y + r}`;
  }
  if (shape === "diamond") return `M${x} ${y - r}L${x + r} ${y}L${x} ${y + r}L${x - r} ${y}Z`;
  return `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
}

// Room around the plotting area, px, for axes and their labels.
const ROOM = { left: 62, top: 8, right: 10, bottom: 50 };

// The ranges of a chart of that size.
function fitted(spec, width, height) {
  if (!spec.equal) return spec;
  const inner = { x: width - ROOM.left - ROOM.right, y: height - ROOM.top - ROOM.bottom };
  const unit = Math.max(...["x", "y"].map((k) => (spec[k].max - spec[k].min) / inner[k]));
  const around = (k) => {
    const middle = (spec[k].min + spec[k].max) / 2;
    const half = (unit * inner[k]) / 2;
    return { ...spec[k], min: middle - half, max: middle + half };
  };
  return { ...spec, x: around("x"), y: around("y") };
}

const within = (spec, [x, y]) =>
  x >= spec.x.min && x <= spec.x.max && y >= spec.y.min && y <= spec.y.max;

// A layer as one path with its paint.  `scale` is device pixels a CSS pixel.
function layerPath(spec, layer, toX, toY, scale) {
  const at = ([x, y]) => [Math.round(toX(x) * 10) / 10, Math.round(toY(y) * 10) / 10];
  if (layer.kind === "line") {
    const d = layer.points.map((p, i) => (i ? "L" : "M") + at(p).join(" ")).join("");
    const dash = layer.dashed ? [6 * scale, 4 * scale] : [];
    return { d, stroke: true, fill: false, width: (layer.width || 2) * scale, dash, alpha: 1 };
  }
  const d = layer.points
    .filter((p) => within(spec, p))
    .map((p) => markPath(layer.shape, ...at(p), scale))
    .join("");
  const filled = layer.shape === "dot";
  return { d, stroke: !filled, fill: filled, width: 1.3 * scale, dash: [], alpha: layer.faint ? 0.5 : 0.9 };
}

const colour = (style) => getComputedStyle(document.documentElement).getPropertyValue(`--${style}`).trim();
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

// --- uPlot ---

function paintLayer(u, spec, layer) {
  const { ctx } = u;
  const scale = uPlot.pxRatio;
  const toX = (v) => u.valToPos(v, "x", true);
  const toY = (v) => u.valToPos(v, "y", true);
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  ctx.clip();
  ctx.strokeStyle = ctx.fillStyle = colour(layer.style);
  if (layer.kind === "text") {
    ctx.font = FONT.replace("12px", `600 ${12 * scale}px`);
    ctx.textAlign = layer.anchor === "middle" ? "center" : layer.anchor;
    ctx.textBaseline = layer.below ? "top" : "bottom";
    const shift = (layer.below ? 5 : -4) * scale;
    ctx.lineWidth = 4 * scale;
    ctx.strokeStyle = colour("card");
    for (const [x, y] of layer.points) {
      ctx.strokeText(layer.text, toX(x), toY(y) + shift);
      ctx.fillText(layer.text, toX(x), toY(y) + shift);
    }
  } else {
    const path = layerPath(spec, layer, toX, toY, scale);
    const shape = new Path2D(path.d);
    ctx.globalAlpha = path.alpha;
    ctx.lineWidth = path.width;
    ctx.setLineDash(path.dash);
    if (path.fill) ctx.fill(shape);
    if (path.stroke) ctx.stroke(shape);
  }
  ctx.restore();
  return null;
}

function drawWithUplot(host, spec, width, height) {
  const axis = (label, isX) => ({
    label, labelFont: FONT, font: FONT, stroke: colour("quiet"), labelSize: 18, labelGap: 0,
    size: (isX ? ROOM.bottom : ROOM.left) - 18, gap: 4, space: isX ? 60 : 32,
    values: (u, ticks) => ticks.map((v) => words(v, 6)),
    grid: { stroke: colour("grid"), width: 1 },
    ticks: { stroke: colour("line"), width: 1, size: 5 },
  });
  const scaleOf = ({ min, max }) => ({ time: false, auto: false, range: [min, max] });
  const series = spec.layers.map((layer) => ({
    facets: [{ scale: "x", auto: false }, { scale: "y", auto: false }],
    paths: (u) => paintLayer(u, spec, layer),
  }));
  const data = spec.layers.map((layer) => [layer.points.map((p) => p[0]), layer.points.map((p) => p[1])]);
  const plot = new uPlot(
    {
      mode: 2, width, height, padding: [ROOM.top, ROOM.right, 0, 0],
      scales: { x: scaleOf(spec.x), y: scaleOf(spec.y) },
      axes: [axis(spec.x.label, true), axis(spec.y.label, false)],
      series: [null, ...series],
      legend: { show: false },
      cursor: { show: false },
    },
    [null, ...data],
    host,
  );
  const ratio = uPlot.pxRatio;
  return {
    toX: (v) => plot.valToPos(v, "x", true) / ratio,
    toY: (v) => plot.valToPos(v, "y", true) / ratio,
  };
}

// --- SVG ---

function niceTicks(min, max, wanted) {
  const raw = (max - min) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const ticks = [];
  for (let i = Math.ceil(min / step); i * step <= max; ++i) ticks.push(i * step);
  return ticks;
}

function svgElement(parent, name, attributes, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return parent.appendChild(element);
}

function drawSvgAxes(svg, spec, { left, top, right, bottom }, toX, toY) {
  const line = (x1, y1, x2, y2) =>
    svgElement(svg, "line", { x1, y1, x2, y2, stroke: colour("grid"), "stroke-width": 1 });
  for (const v of niceTicks(spec.x.min, spec.x.max, (right - left) / 60)) {
    line(toX(v), top, toX(v), bottom);
    svgElement(svg, "text", { x: toX(v), y: bottom + 16, "text-anchor": "middle" }, words(v, 6));
  }
  for (const v of niceTicks(spec.y.min, spec.y.max, (bottom - top) / 36)) {
    line(left, toY(v), right, toY(v));
    svgElement(svg, "text", { x: left - 6, y: toY(v) + 4, "text-anchor": "end" }, words(v, 6));
  }
  const middle = (top + bottom) / 2;
  svgElement(svg, "text", { x: (left + right) / 2, y: bottom + 34, "text-anchor": "middle" }, spec.x.label);
  svgElement(svg, "text",
    { x: 12, y: middle, "text-anchor": "middle", transform: `rotate(-90 12 ${middle})` }, spec.y.label);
}

let clipCount = 0;

function drawWithSvg(host, spec, width, height) {
  const svg = svgElement(host, "svg", { class: "chart", viewBox: `0 0 ${width} ${height}` });
  const box = { left: ROOM.left, top: ROOM.top, right: width - ROOM.right, bottom: height - ROOM.bottom };
  const toX = (v) => box.left + ((v - spec.x.min) / (spec.x.max - spec.x.min)) * (box.right - box.left);
  const toY = (v) => box.bottom - ((v - spec.y.min) / (spec.y.max - spec.y.min)) * (box.bottom - box.top);
  drawSvgAxes(svg, spec, box, toX, toY);
  const id = `clip-${++clipCount}`;
  const clip = svgElement(svg, "clipPath", { id });
  svgElement(clip, "rect",
    { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top });
  const group = svgElement(svg, "g", { "clip-path": `url(#${id})` });
  for (const layer of spec.layers) {
    const paint = colour(layer.style);
    if (layer.kind === "text") {
      for (const [x, y] of layer.points) {
        const text = svgElement(group, "text", { x: toX(x), y: toY(y) + (layer.below ? 15 : -6), "text-anchor": layer.anchor }, layer.text);
        text.style.fill = paint;
        text.style.fontWeight = "600";
      }
      continue;
    }
    const path = layerPath(spec, layer, toX, toY, 1);
    svgElement(group, "path", {
      d: path.d, fill: path.fill ? paint : "none", stroke: path.stroke ? paint : "none",
      "stroke-width": path.width, "stroke-dasharray": path.dash.join(" "), opacity: path.alpha,
    });
  }
  return { toX, toY };
}

// --- the chart with its words, pointer and keys ---

const charts = new Set();

// A figure in `parent`; show(spec, title, note) draws or redraws it.
class Chart {
  constructor(parent, aspect) {
    this.aspect = aspect;
    this.figure = parent.appendChild(document.createElement("figure"));
    this.figure.className = "plot";
    this.title = this.add("h4", "");
    const lines = this.add("div", "words");
    this.readout = this.add("p", "readout", lines);
    this.readout.setAttribute("aria-live", "polite");
    this.note = this.add("p", "note", lines);
    this.canvas = this.add("div", "canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.addEventListener("pointermove", (event) => this.point(event));
    this.canvas.addEventListener("pointerleave", () => this.select(null));
    this.canvas.addEventListener("blur", () => this.select(null));
    this.canvas.addEventListener("keydown", (event) => this.step(event));
    this.observer = new ResizeObserver(() => {
      if (this.canvas.clientWidth !== this.width) this.draw();
    });
    this.observer.observe(this.canvas);
    charts.add(this);
  }

  add(name, className, parent = this.figure) {
    const element = parent.appendChild(document.createElement(name));
    element.className = className;
    return element;
  }

  show(spec, title, note) {
    this.wanted = spec;
    this.title.textContent = title;
    this.note.textContent = note;
    this.canvas.setAttribute("aria-label", `${title}. ${note} Arrow keys step through the trials.`);
    this.draw();
  }

  draw() {
    this.width = this.canvas.clientWidth;
    if (!this.wanted || !this.width) return;
    const height = Math.round(this.width * this.aspect);
    this.spec = fitted(this.wanted, this.width, height);
    this.canvas.style.height = `${height}px`;
    this.canvas.replaceChildren();
    this.selected = null;
    const draw = window.uPlot ? drawWithUplot : drawWithSvg;
    this.map = draw(this.canvas, this.spec, this.width, height);
    this.marks = this.spec.layers
      .filter((layer) => layer.kind === "points")
      .flatMap((layer) => layer.points)
      .filter((p) => p.length > 2 && within(this.spec, p))
      .sort((a, b) => a[0] - b[0]);
    this.select(null);
  }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    let nearest = null;
    let best = 24 ** 2;
    for (const mark of this.marks) {
      const dx = this.map.toX(mark[0]) - (event.clientX - box.left);
      const dy = this.map.toY(mark[1]) - (event.clientY - box.top);
      if (dx * dx + dy * dy < best) {
        best = dx * dx + dy * dy;
        nearest = mark;
      }
    }
    this.select(nearest);
  }

  step(event) {
    const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") this.select(null);
    if (!by || !this.marks.length) return;
    event.preventDefault();
    const at = this.selected ? this.marks.indexOf(this.selected) + by : 0;
    this.select(this.marks[(at + this.marks.length) % this.marks.length]);
  }

  select(mark) {
    if (mark === this.selected && this.ring?.isConnected) return;
    this.selected = mark;
    this.ring?.remove();
    this.readout.textContent = mark ? this.spec.describe(mark[2]) : "";
    if (!mark) return;
    this.ring = this.canvas.appendChild(document.createElement("div"));
    this.ring.className = "ring";
    this.ring.style.left = `${this.map.toX(mark[0])}px`;
    this.ring.style.top = `${this.map.toY(mark[1])}px`;
  }
}

const redrawAll = () => charts.forEach((chart) => chart.draw());
