"use strict";
// One real drive over the simulated ones: the way on the floor, and the heading in time.

// Places along the arc of constant turning from the start to `end`: what is drawn where no path is.
function arcTo(end, duration, steps = 30) {
  const w = end.theta;
  const [a, b] = Math.abs(w) < 1e-6 ? [1, 0] : [Math.sin(w) / w, (1 - Math.cos(w)) / w];
  const det = a * a + b * b;
  const [vx, vy] = [(a * end.x + b * end.y) / det, (a * end.y - b * end.x) / det];
  return Array.from({ length: steps + 1 }, (_, i) => {
    const s = i / steps;
    const [c, d] = Math.abs(w) < 1e-6 ? [s, 0] : [Math.sin(s * w) / w, (1 - Math.cos(s * w)) / w];
    return [s * duration, c * vx - d * vy, d * vx + c * vy, s * w];
  });
}

// Headings without their jumps at half a turn.
function unwrapped(path) {
  let last = 0;
  return path.map(([t, x, y, theta]) => {
    last += wrapped(theta - last);
    return [t, x, y, last];
  });
}

const byScore = (trials) => [...trials].sort((a, b) => a.tuned_score - b.tuned_score);

// What the page came with, or the worst and the median trial of all and of every command.
function drivesOffered(trials) {
  if (PAGE.drives?.length) return PAGE.drives.map((d) => ({ ...d, trial: trials[d.trial] })).filter((d) => d.trial);
  const offered = [];
  const add = (some, of) => {
    const sorted = byScore(some.filter((t) => isNumber(t.tuned_score)));
    if (!sorted.length) return;
    offered.push({ why: `worst of ${of}`, trial: sorted[0] }, { why: `median of ${of}`, trial: sorted[Math.floor(sorted.length / 2)] });
  };
  add(trials, "all");
  const commands = commandsOf(trials);
  if (commands.length > 1) for (const c of commands) add(trials.filter((t) => t.command === c), commandName(c));
  return offered;
}

const DRIVE_LINES = [
  { key: "tuned", dashed: true, width: 2 },
  { key: "final", width: 2 },
  { key: "measured", width: 2.4 },
];

// A path as it was kept, or in its place the arc to its end.
function pathOrArc(path, end, duration) {
  const known = path?.length > 1;
  return { known, path: unwrapped(known ? path : arcTo(end, duration)) };
}

const driveLines = (drive) => DRIVE_LINES.map((line) => {
  const end = poseOf(drive.trial, line.key);
  return { ...line, end, ...pathOrArc(drive[line.key], end, drive.trial.duration_s) };
});

const tick = ({ x, y, theta }, length) => [1000 * x, 1000 * y, 1000 * x + length * Math.cos(theta), 1000 * y + length * Math.sin(theta)];

function wayLayers(drive, lines) {
  const layers = [];
  for (const { key, path, known, dashed, width } of lines) {
    layers.push({ kind: "line", style: key, points: path.map(([, x, y]) => [1000 * x, 1000 * y]), dashed: dashed || !known, width, faint: known ? 0.95 : 0.45, name: `${key} path` });
  }
  for (const { key, end, dashed } of lines) {
    if (key === "measured") continue;
    const cov = turned(block(drive.trial, key, "x", "y").map((v) => 1e6 * v), end.theta);
    layers.push({ kind: "line", style: key, points: ellipse([1000 * end.x, 1000 * end.y], cov), dashed, width: 1.8, name: `${key} ellipse` });
  }
  const reach = Math.max(20, ...lines.map(({ end }) => 1000 * Math.hypot(end.x, end.y)));
  for (const { key, end } of lines) {
    layers.push({ kind: "arrows", style: key, width: 2, arrows: [tick(end, 0.08 * reach)], name: `${key} end and heading` });
    layers.push({ kind: "points", shape: SHAPE[key], style: key, points: [[1000 * end.x, 1000 * end.y]] });
  }
  layers.push({ kind: "arrows", style: "quiet", width: 2, arrows: [tick({ x: 0, y: 0, theta: 0 }, 0.08 * reach)], name: "start" });
  return layers;
}

function headingLayers(drive, lines) {
  const layers = [];
  for (const { key, path, known, dashed, width } of lines) {
    layers.push({ kind: "line", style: key, points: path.map(([t, , , theta]) => [t, degrees(theta)]), dashed: dashed || !known, width, faint: known ? 0.95 : 0.45, name: `${key} heading` });
    const [at, , , whole] = path.at(-1);
    if (key !== "measured") {
      const half = degrees(1.645 * Math.sqrt(Math.max(drive.trial[`${key}_cov_tt`], 0)));
      layers.push({ kind: "line", style: key, points: [[at, degrees(whole) - half], [at, degrees(whole) + half]], width: 3 });
    }
    layers.push({ kind: "points", shape: SHAPE[key], style: key, points: [[at, degrees(whole)]] });
  }
  return layers;
}

function framed(layers, labels) {
  const points = layers.flatMap((l) => (l.points || l.arrows.flatMap(([a, b, c, d]) => [[a, b], [c, d]])));
  const axis = (k) => ({ ...roomy(...extent(points.map((p) => p[k]).filter(isNumber)), 0.08), label: labels[k] });
  return { x: axis(0), y: axis(1), layers, describe: () => "" };
}

let showDrive = () => {};

function startDrives(trials) {
  const controls = document.getElementById("drive-controls");
  if (!controls || PICTURES) return;
  const parent = document.getElementById("drive-plots");
  const charts = [new Chart(parent, 0.8), new Chart(parent, 0.8)];
  const offered = drivesOffered(trials);
  if (!offered.length) return;
  const chooser = choice(controls, "Drive", offered.map((d, i) => [String(i), d.why]), draw);
  const select = controls.querySelector("select");
  const caption = element(controls, "p", { className: "quiet" });

  function draw() {
    const drive = offered[Number(chooser())];
    const lines = driveLines(drive);
    const without = lines.filter((l) => !l.known).map((l) => MODEL_NAME[l.key] || l.key);
    const arcs = without.length ? `Faint: no path of ${without.join(", ")} was kept, an arc joins its start and end.` : "";
    caption.textContent = `${describeTrial(drive.trial)}.`;
    charts[0].show({ ...framed(wayLayers(drive, lines), ["ahead of the start, mm", "left of the start, mm"]), equal: true },
      "On the floor, from its start", arcs);
    charts[1].show(framed(headingLayers(drive, lines), ["time, s", "heading turned, degrees"]),
      "Heading in time", "Bars at the ends hold 90 % of the predicted headings.");
  }

  showDrive = (trial) => {
    let at = offered.findIndex((d) => d.trial === trial);
    if (at < 0) {
      at = offered.push({ why: `chosen: ${trial.session}, trial ${trial.trial}`, trial }) - 1;
      select.add(new Option(offered[at].why, String(at)));
    }
    chooser.set(String(at));
    draw();
    goTo("drives");
  };
  draw();
}
