"use strict";
// A figure: a plot with its words, pointer, keys, zoom, and copies to take away.

// --- to take away ---

function offer(name, type, content) {
  const blob = content instanceof Blob ? content : new Blob([content], { type });
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const csvCell = (v) => {
  const text = v === null || v === undefined || Number.isNaN(v) ? "" : String(v);
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};
const csvText = (rows) => rows.map((row) => row.map(csvCell).join(",")).join("\n") + "\n";
const fileName = (text) => text.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60) || "figure";

function svgText(svg) {
  const copy = svg.cloneNode(true);
  const { width, height } = svg.viewBox.baseVal;
  copy.setAttribute("xmlns", SVG_NAMESPACE);
  const ground = document.createElementNS(SVG_NAMESPACE, "rect");
  for (const [k, v] of Object.entries({ width, height, fill: colour("card") })) ground.setAttribute(k, v);
  copy.prepend(ground);
  return new XMLSerializer().serializeToString(copy);
}

function offerPng(svg, name) {
  const { width, height } = svg.viewBox.baseVal;
  const image = new Image();
  image.addEventListener("load", () => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 3 * width, height: 3 * height });
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    canvas.toBlob((blob) => offer(name, "image/png", blob));
  });
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgText(svg))}`;
}

// A row a mark, of any layer.
function layersCsv(spec) {
  const rows = [["layer", "style", spec.x.label || "x", spec.y.label || "y", "x2_or_high", "y2"]];
  for (const layer of spec.layers) {
    for (const p of layer.points || layer.arrows || layer.cells || []) {
      const numbers = p.filter((v) => typeof v !== "object");
      rows.push([layer.name || layer.text || layer.kind, layer.style, ...numbers.slice(0, 4)]);
    }
  }
  return csvText(rows);
}

// --- zoom ---

// The part of an axis between two places of it, or grown and shrunk about one of them.
function part(axis, a, b) {
  return { ...axis, min: Math.min(a, b), max: Math.max(a, b) };
}

function scaled(axis, about, factor) {
  const [f, g] = [forward(axis), backward(axis)];
  const at = f(about);
  return { ...axis, min: g(at + (f(axis.min) - at) * factor), max: g(at + (f(axis.max) - at) * factor) };
}

const charts = new Set();

class Chart {
  constructor(parent, aspect, large = false) {
    this.aspect = aspect;
    this.figure = element(parent, "figure", { className: large ? "plot large" : "plot" });
    this.title = element(this.figure, "h4");
    const lines = element(this.figure, "div", { className: "words" });
    this.readout = element(lines, "p", { className: "readout", ariaLive: "polite" });
    this.note = element(lines, "p", { className: "note" });
    this.canvas = element(this.figure, "div", { className: "canvas", tabIndex: 0, role: "img" });
    this.addTools();
    this.listen();
    this.observer = new ResizeObserver(() => {
      if (this.canvas.clientWidth !== this.width) this.draw();
    });
    this.observer.observe(this.canvas);
    charts.add(this);
  }

  addTools() {
    const tools = element(this.figure, "div", { className: "tools" });
    const button = (text, label, action) =>
      element(tools, "button", { type: "button", title: label, ariaLabel: label }, text).addEventListener("click", action);
    button("+", "Zoom in", () => this.zoomBy(0.6));
    button("−", "Zoom out", () => this.zoomBy(1 / 0.6));
    button("⟲", "Show all again", () => this.zoomTo(null));
    element(tools, "span", { className: "gap" });
    const name = () => fileName(`${document.querySelector("h1")?.dataset.file || "gapfarm"} ${this.title.textContent}`);
    button("SVG", "Save this figure as SVG", () => offer(`${name()}.svg`, "image/svg+xml", svgText(this.map.svg)));
    button("PNG", "Save this figure as PNG", () => offerPng(this.map.svg, `${name()}.png`));
    button("CSV", "Save this figure's numbers as CSV", () => offer(`${name()}.csv`, "text/csv", layersCsv(this.wanted)));
  }

  listen() {
    const on = (type, handler) => this.canvas.addEventListener(type, (event) => this.map && handler(event));
    on("pointerdown", (event) => this.beginDrag(event));
    on("pointermove", (event) => (this.drag ? this.moveDrag(event) : this.point(event)));
    on("pointerup", (event) => this.endDrag(event));
    on("pointercancel", () => this.dropDrag());
    on("pointerleave", () => !this.drag && this.select(null));
    on("dblclick", () => this.zoomTo(null));
    on("blur", () => this.select(null));
    on("keydown", (event) => this.key(event));
  }

  // Keeps the zoom when only the marks changed.
  show(spec, title, note, keepZoom = false) {
    this.wanted = spec;
    if (!keepZoom) this.zoom = null;
    this.title.textContent = title;
    this.noteText = note;
    this.draw();
  }

  draw() {
    this.width = this.canvas.clientWidth;
    if (!this.wanted || !this.width) return;
    // On a phone a flat figure would be too small to read.
    const height = Math.round(this.width * (this.width < 480 ? Math.max(this.aspect, 0.85) : this.aspect));
    this.spec = fitted({ ...this.wanted, ...this.zoom }, this.width, height);
    this.canvas.style.height = `${height}px`;
    this.canvas.replaceChildren();
    const read = this.readout.textContent;
    this.selected = null;
    this.map = drawPlot(this.canvas, this.spec, this.width, height);
    const all = this.spec.layers.filter((layer) => layer.kind === "points" || layer.kind === "arrows")
      .flatMap((layer) => (layer.points || layer.arrows.map((a) => [a[2], a[3], a[4]])))
      .filter((p) => p[2] !== undefined && isNumber(p[0]) && isNumber(p[1]));
    this.marks = all.filter((p) => within(this.spec, p)).sort((a, b) => a[0] - b[0]);
    const outside = new Set(all.map((p) => p[2])).size - new Set(this.marks.map((p) => p[2])).size;
    const beyond = outside ? ` ${outside} beyond the frame${this.zoom ? "" : " (− shows them)"}.` : "";
    this.note.textContent = this.noteText + beyond;
    const keys = "Arrow keys step through the marks, plus and minus zoom, 0 shows all.";
    this.canvas.ariaLabel = `${this.title.textContent}. ${this.note.textContent} ${keys}`;
    // New data, other colours and widths take no mark from its reader.
    this.select((read && this.marks.find((mark) => this.spec.describe(mark[2]) === read)) || null);
  }

  // --- zoom ---

  zoomTo(ranges) {
    this.zoom = ranges;
    this.draw();
  }

  zoomBy(factor) {
    const { x, y } = this.spec;
    const middle = (axis) => backward(axis)((forward(axis)(axis.min) + forward(axis)(axis.max)) / 2);
    const at = this.selected || [middle(x), middle(y)];
    this.zoomTo({ x: scaled(x, at[0], factor), y: scaled(y, at[1], factor) });
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  // By mouse or pen: a finger scrolls the page.
  beginDrag(event) {
    if (event.pointerType === "touch" || event.button) return;
    this.drag = { from: this.place(event) };
    this.canvas.setPointerCapture(event.pointerId);
  }

  moveDrag(event) {
    const [[x0, y0], [x1, y1]] = [this.drag.from, this.place(event)];
    if (Math.hypot(x1 - x0, y1 - y0) < 6) return;
    this.drag.frame ??= element(this.canvas, "div", { className: "zoom-frame" });
    Object.assign(this.drag.frame.style, {
      left: `${Math.min(x0, x1)}px`, top: `${Math.min(y0, y1)}px`,
      width: `${Math.abs(x1 - x0)}px`, height: `${Math.abs(y1 - y0)}px`,
    });
  }

  endDrag(event) {
    if (!this.drag) return;
    const { from, frame } = this.drag;
    this.dropDrag();
    if (!frame) return this.pick(event);
    const to = this.place(event);
    const wide = Math.abs(to[0] - from[0]) > 8;
    const high = Math.abs(to[1] - from[1]) > 8;
    const { x, y } = this.spec;
    this.zoomTo({
      x: wide ? part(x, this.map.fromX(from[0]), this.map.fromX(to[0])) : x,
      y: high ? part(y, this.map.fromY(from[1]), this.map.fromY(to[1])) : y,
    });
  }

  dropDrag() {
    this.drag?.frame?.remove();
    this.drag = null;
  }

  // --- reading marks ---

  point(event) {
    const [x, y] = this.place(event);
    let [nearest, least] = [null, 24];
    for (const mark of this.marks) {
      const distance = Math.hypot(this.map.toX(mark[0]) - x, this.map.toY(mark[1]) - y);
      if (distance < least) [nearest, least] = [mark, distance];
    }
    this.select(nearest);
  }

  pick(event) {
    this.point(event);
    if (this.selected && this.wanted.picked) this.wanted.picked(this.selected[2]);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const act = {
      "+": () => this.zoomBy(0.6), "=": () => this.zoomBy(0.6), "-": () => this.zoomBy(1 / 0.6), 0: () => this.zoomTo(null),
      Escape: () => this.select(null),
      Enter: () => this.selected && this.wanted.picked?.(this.selected[2]),
    }[event.key];
    const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (act) act();
    if (act && event.key !== "Escape") event.preventDefault();
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
    this.ring = element(this.canvas, "div", { className: "ring" });
    this.ring.style.left = `${this.map.toX(mark[0])}px`;
    this.ring.style.top = `${this.map.toY(mark[1])}px`;
  }
}

const redrawAll = () => charts.forEach((chart) => chart.draw());
