"use strict";
// The floor from above: every drive where it was driven, coloured by how far off its prediction
// was, and what the named effects have to do with places and directions.

const MEASURES = [
  { key: "position", label: "position", unit: "mm",
    of: (t, model) => 1000 * Math.hypot(t[`${model}_residual_x`], t[`${model}_residual_y`]) },
  { key: "heading", label: "heading", unit: "mrad", of: (t, model) => 1000 * Math.abs(t[`${model}_residual_theta`]) },
];
const BIN_ENDS = [0.5, 0.75, 0.9, 0.97];  // shares of the trials, by the first model's errors

const valueOf = (key) => {
  const found = (PAGE.parameters || []).find((p) => p.key === key);
  return found && (found.choice ?? found.final);
};

// A round number at or below `most`.
function roundBelow(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((m) => m * power).find((v) => v <= most) ?? power;
}

function floorTrial(trial) {
  const start = poseOf(trial, "start");
  const end = composed(start, poseOf(trial, "measured"));
  const error = (model) => {
    const heading = start.theta + trial[`${model}_theta`];
    const [x, y] = [trial[`${model}_residual_x`], trial[`${model}_residual_y`]];
    const [c, s] = [Math.cos(heading), Math.sin(heading)];
    return [c * x - s * y, s * x + c * y];
  };
  return { trial, start, end, error: { tuned: error("tuned"), final: error("final") } };
}

function binsOf(values) {
  const sorted = values.filter(isNumber).sort((a, b) => a - b);
  if (!sorted.length) return [1];
  const ends = BIN_ENDS.map((share) => Number(quantile(sorted, share).toPrecision(2)));
  return [...new Set(ends)];
}

// --- what the effects have to do with places ---

const effectNamed = (name) => (PAGE.effects || []).find((e) => e.name === name);

const circle = (x, y, r) => Array.from({ length: 61 }, (_, i) =>
  [x + r * Math.cos((2 * Math.PI * i) / 60), y + r * Math.sin((2 * Math.PI * i) / 60)]);

function seamLayers(frame) {
  const at = valueOf("camera_seam.position");
  const acrossY = valueOf("camera_seam.axis") === "y";
  const { min, max } = acrossY ? frame.x : frame.y;
  const point = (along, across) => (acrossY ? [along, across] : [across, along]);
  const found = effectNamed("camera_seam").parameters.position;
  const layers = [];
  if (found && found.lo < found.hi) {
    layers.push({ kind: "area", style: "place", dashed: true, name: "seam, 90 % interval",
                  points: [point(min, found.lo), point(max, found.lo), point(max, found.hi), point(min, found.hi)] });
  }
  layers.push({ kind: "line", style: "place", width: 2.5, points: [point(min, at), point(max, at)], name: "seam" });
  layers.push({ kind: "text", style: "place", text: `seam: ${acrossY ? "y" : "x"} = ${numberText(at)} m`, anchor: acrossY ? "end" : "start",
                points: [acrossY ? [frame.x.max - 0.02 * (frame.x.max - frame.x.min), at] : [at, frame.y.min + 0.06 * (frame.y.max - frame.y.min)]] });
  return layers;
}

function placeLayers(frame) {
  const layers = [];
  for (const name of ["friction_patch", "friction_patch_2"].filter(effectNamed)) {
    const [x, y, r, ratio] = ["x", "y", "radius", "ratio"].map((k) => valueOf(`${name}.${k}`));
    layers.push({ kind: "area", style: "place", points: circle(x, y, r), name: "patch" });
    layers.push({ kind: "text", style: "place", text: `patch: ${numberText(ratio, 2)} × the friction`, points: [[x, y]], anchor: "middle" });
  }
  if (effectNamed("camera_seam")) layers.push(...seamLayers(frame));
  return layers;
}

// Directions have no place: arrows in a corner.
function drawCorner(group, { box, toX }, times) {
  const ink = colour("ink");
  const ground = { stroke: colour("card"), "stroke-width": 4, "paint-order": "stroke", "font-size": 12, fill: ink };
  const directions = [["floor_tilt", "downhill"], ["floor_nap", "with the nap"]].filter(([name]) => effectNamed(name));
  directions.forEach(([name, label], i) => {
    const angle = valueOf(`${name}.direction`);
    const [x, y] = [box.right - 34, box.top + 34 + 66 * i];
    const [dx, dy] = [22 * Math.cos(angle), -22 * Math.sin(angle)];
    svgElement(group, "path", { d: arrowPath([x - dx, y - dy, x + dx, y + dy], 11), stroke: colour("place"), "stroke-width": 3, fill: "none" });
    svgElement(group, "text", { x: box.right - 4, y: y + 36, "text-anchor": "end", ...ground }, label);
  });
  const perMetre = toX(1) - toX(0);
  const length = roundBelow((box.right - box.left) / 4 / perMetre);
  const bar = (metres, text, y) => {
    const x = box.left + 10;
    svgElement(group, "path", { d: `M${x} ${y - 4}v8m0 -4h${metres * perMetre}m0 -4v8`, stroke: ink, "stroke-width": 1.6, fill: "none" });
    svgElement(group, "text", { x: x + metres * perMetre + 6, y: y + 4, ...ground }, text);
  };
  bar(length, `${numberText(length)} m of floor`, box.bottom - 12);
  if (!times) return;
  const error = roundBelow((box.right - box.left) / 6 / perMetre / times);
  bar(error * times, `${numberText(1000 * error)} mm of error`, box.bottom - 30);
}

// --- the section ---

function floorLayers(some, model, measure, ends, shown, times) {
  const layers = [];
  const bins = groupBy(some, (f) => {
    const bin = ends.findIndex((end) => measure.of(f.trial, model) <= end);
    return bin < 0 ? ends.length : bin;
  });
  for (const bin of shown.has("drives") ? distinct(bins.keys()) : []) {
    layers.push({ kind: "arrows", style: `scale-${bin}`, width: 1 + 0.3 * bin, faint: some.length > 150 && bin < 2 ? 0.55 : 0.9,
                  arrows: bins.get(bin).map((f) => [f.start.x, f.start.y, f.end.x, f.end.y, f.trial]), name: "drive" });
  }
  if (shown.has("errors")) {
    layers.push({ kind: "arrows", style: "ink", width: 1, head: 4, faint: 0.75, name: `error times ${times}`,
                  arrows: some.map((f) => {
                    const [ex, ey] = f.error[model];
                    return [f.end.x, f.end.y, f.end.x + times * ex, f.end.y + times * ey];
                  }) });
  }
  return layers;
}

function fillLegend(legend, ends, measure) {
  const text = (i) => {
    if (i === 0) return `up to ${numberText(ends[0], 2)} ${measure.unit}`;
    if (i === ends.length) return `over ${numberText(ends.at(-1), 2)} ${measure.unit}`;
    return `${numberText(ends[i - 1], 2)} to ${numberText(ends[i], 2)}`;
  };
  legend.replaceChildren();
  for (let i = 0; i <= ends.length; ++i) {
    const item = element(legend, "li");
    element(item, "span", { className: "chip" }).style.background = `var(--scale-${i})`;
    item.append(text(i));
  }
}

function startFloor(trials) {
  const section = document.getElementById("floor");
  if (!section || PICTURES) return;
  const controls = document.getElementById("floor-controls");
  const legend = document.getElementById("floor-legend");
  const all = trials.map(floorTrial);
  const chart = new Chart(document.getElementById("floor-plot"), 0.8, true);
  const model = radios(controls, "Model", MODELS.map((m) => ({ key: m, label: MODEL_NAME[m] })), draw);
  const by = choice(controls, "Colour by error in", MEASURES.map((m) => [m.key, m.label]), draw);
  const command = choice(controls, "Command", [["all", "all"], ...commandsOf(trials).map((c) => [c, commandName(c)])], draw);
  const shown = checks(controls, "Show", ["drives", "errors"], () => draw(true));
  const span = (k) => robustLimits(all.flatMap((f) => [f.start[k], f.end[k]]), [], 0.08);
  const frame = { x: span("x"), y: span("y") };
  // An error that one in ten exceeds is drawn a twentieth of the floor long.
  const lengths = all.map((f) => Math.hypot(...f.error.tuned)).filter(isNumber).sort((a, b) => a - b);
  const usual = lengths.length ? quantile(lengths, 0.9) : 0;
  const times = roundBelow(Math.max(1, (frame.x.max - frame.x.min) / 20 / Math.max(usual, 1e-6)));

  function draw(keep) {
    const measure = MEASURES.find((m) => m.key === by());
    const ends = binsOf(trials.map((t) => measure.of(t, "tuned")));
    const some = command() === "all" ? all : all.filter((f) => f.trial.command === command());
    const visible = new Set(shown());
    fillLegend(legend, ends, measure);
    const place = placeLayers(frame);
    chart.show(
      { x: { ...frame.x, label: "x of the world, m" }, y: { ...frame.y, label: "y of the world, m" }, equal: true,
        layers: [...floorLayers(some, model(), measure, ends, visible, times), ...place],
        overlay: (group, map) => drawCorner(group, map, visible.has("errors") ? times : 0),
        describe: describeTrial, picked: showDrive },
      `Errors of the ${MODEL_NAME[model()]} model on the floor`,
      `${some.length} drives, from start to end${visible.has("errors") ? `; errors ${numberText(times)} times as long as they are` : ""}.`,
      keep,
    );
  }
  draw();
}
