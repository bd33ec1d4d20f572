"use strict";
// End poses a command: as driven, or as errors around the prediction, with 90 % ellipses.

const POSE_VIEWS = [
  { key: "driven", label: "as driven" },
  { key: "xy", label: "error in x, y", axes: ["x", "y"] },
  { key: "yt", label: "error in y, heading", axes: ["y", "theta"] },
];

const COMMAND_ORDER = ["forward", "backward", "turn_ccw", "turn_cw", "wide_ccw", "wide_cw"];
const commandsOf = (trials) => {
  const found = new Set(trials.map((t) => t.command));
  return [...COMMAND_ORDER.filter((c) => found.delete(c)), ...found];
};
const commandName = (command) => command.replaceAll("_", " ");

function describeTrial(trial) {
  const r = (model, a) => numberText(1000 * trial[`${model}_residual_${a}`], 2);
  const error = (model) => `${r(model, "x")}, ${r(model, "y")} mm, ${r(model, "theta")} mrad`;
  return (
    `${trial.session}, trial ${trial.trial}, ${commandName(trial.command)}` +
    `${PICTURES ? "" : ` ${numberText(trial.duration_s)} s at ${numberText(trial.level)}`}${trial.held_out ? ", held out" : ""}: off by ${error("tuned")} (${MODEL_NAME.tuned}), ` +
    `${error("final")} (${MODEL_NAME.final})`
  );
}

// A push is a condition of its own: there is no choosing among them.
const conditionOf = (t) => (PICTURES ? "all" : `${numberText(t.duration_s)} s at duty ${numberText(t.level)}`);

function drivenSpec(trials, shown) {
  const layers = [];
  const place = (t, of) => [1000 * t[`${of}_x`], 1000 * t[`${of}_y`]];
  for (const model of MODELS.filter((m) => shown.has(m))) {
    for (const group of groupBy(trials, conditionOf).values()) {
      const means = group.map((t) => place(t, model));
      const covs = group.map((t) => turned(block(t, model, "x", "y").map((v) => 1e6 * v), t[`${model}_theta`]));
      const m = mixture(means, covs);
      layers.push({ kind: "line", style: model, points: ellipse(m.mean, m.cov), dashed: model === "tuned" });
    }
  }
  if (shown.has("measured")) {
    const points = trials.map((t) => [...place(t, "measured"), t]);
    layers.unshift({ kind: "points", shape: "cross", style: "measured", points, faint: true });
  }
  return { layers, labels: ["ahead of the start, mm", "left of the start, mm"], equal: true };
}

// In turns on the spot x and y show nothing: the heading is what was driven.
function turnsOnTheSpot(trials) {
  if (PICTURES || !trials.length) return false;
  const middle = (of) => quantile(trials.map(of).sort((a, b) => a - b), 0.5);
  const way = middle((t) => Math.hypot(t.measured_x, t.measured_y));
  return way < 0.05 * middle((t) => Math.abs(t.measured_theta));
}

const circularMean = (angles) =>
  Math.atan2(mean(angles.map(Math.sin)), mean(angles.map(Math.cos)));

// A row a condition: headings about their own mean, with each model's mean and 90 % interval.
function headingSpec(trials, shown) {
  const rows = [...groupBy(trials, conditionOf).entries()]
    .map(([condition, group]) => ({ condition, group, middle: circularMean(group.map((t) => t.measured_theta)) }))
    .sort((a, b) => Math.abs(a.middle) - Math.abs(b.middle));
  const layers = [];
  const bars = { tuned: [], final: [] };
  const crosses = [];
  rows.forEach(({ group, middle }, row) => {
    const off = (angle) => 1000 * wrapped(angle - middle);
    group.forEach((t, i) => crosses.push([off(t.measured_theta), row + 0.16 * Math.sin(7 * i), t]));
    for (const model of MODELS) {
      const means = group.map((t) => off(t[`${model}_theta`]));
      const at = mean(means);
      const spread = mean(means.map((m) => (m - at) ** 2)) + 1e6 * mean(group.map((t) => t[`${model}_cov_tt`]));
      const half = 1.645 * Math.sqrt(spread);
      const y = row + (model === "tuned" ? 0.3 : -0.3);
      bars[model].push([at - half, y], [at + half, y], [NaN, NaN], [at, y - 0.12], [at, y + 0.12], [NaN, NaN]);
    }
  });
  if (shown.has("measured")) layers.push({ kind: "points", shape: "cross", style: "measured", points: crosses, faint: true });
  for (const model of MODELS.filter((m) => shown.has(m))) {
    layers.push({ kind: "line", style: model, points: bars[model], width: 2.5, dashed: model === "tuned" });
  }
  const label = ({ group, middle }) =>
    `${numberText(group[0].duration_s)} s · ${numberText(degrees(middle), 2)}°`;
  return { layers, labels: ["heading about the mean of its row, mrad", ""],
           rows: rows.map((r, i) => [i, label(r)]) };
}

function errorSpec(trials, shown, [a, b]) {
  const layers = [{ kind: "points", shape: "cross", style: "quiet", points: [[0, 0]] }];
  const ellipses = [];
  for (const model of MODELS.filter((m) => shown.has(m))) {
    const at = (t) => [1000 * t[`${model}_residual_${a}`], 1000 * t[`${model}_residual_${b}`]];
    if (shown.has("measured")) {
      layers.push({ kind: "points", shape: SHAPE[model], style: model,
                    points: trials.map((t) => [...at(t), t]), faint: true });
    }
    const cov = mixture(trials.map(() => [0, 0]), trials.map((t) => block(t, model, a, b).map((v) => 1e6 * v))).cov;
    ellipses.push({ kind: "line", style: model, points: ellipse([0, 0], cov), dashed: model === "tuned", width: 2.5 });
  }
  layers.push(...ellipses);
  for (const { style, points } of ellipses) {
    const end = points.reduce((top, p) => (style === "tuned" ? p[1] > top[1] : p[1] < top[1]) ? p : top);
    layers.push({ kind: "text", style, points: [end], text: MODEL_NAME[style], anchor: "middle", below: style === "final" });
  }
  return { layers, labels: [a, b].map((k) => `${COMPONENT[k]}, ${UNIT[k]}`), equal: b !== "theta" };
}

// "Inside the 90 % ellipse: tuned 71 %, final 89 %", each trial against its own prediction.
function coverage(trials, [a, b]) {
  const share = (model) =>
    mean(trials.map((t) =>
      inside(t[`${model}_residual_${a}`], t[`${model}_residual_${b}`], block(t, model, a, b)) ? 100 : 0));
  return `${trials.length} trials; inside their 90 % ellipse: ${MODEL_NAME.tuned} ${numberText(share("tuned"), 2)} %, ` +
    `${MODEL_NAME.final} ${numberText(share("final"), 2)} %.`;
}

function startPoses(trials) {
  const controls = document.getElementById("pose-controls");
  const commands = commandsOf(trials).map((c) => [c, trials.filter((t) => t.command === c)]);
  const parent = document.getElementById("pose-plots");
  const panels = commands.map(() => new Chart(parent, 0.85));
  const conditions = [...new Set(trials.map(conditionOf))].sort();
  const view = radios(controls, "View", POSE_VIEWS, draw);
  const shown = checks(controls, "Show", ["measured", "tuned", "final"], draw);
  const condition = PICTURES ? () => "all"
    : choice(controls, "Condition", ["all", ...conditions].map((c) => [c, c]), draw);

  // The frame holds the bulk of the trials and all of the models' ellipses.
  function frame(spec, k) {
    if (spec.rows && k) return { min: -0.7, max: spec.rows.length - 0.3, label: "", room: 88, ticks: spec.rows };
    const of = (kinds) => spec.layers.filter((l) => kinds.includes(l.kind)).flatMap((l) => l.points.map((p) => p[k]));
    return { ...robustLimits(of(["points"]), of(["line"])), label: spec.labels[k] };
  }

  function specOf(some, visible, axes) {
    if (axes) return errorSpec(some, visible, axes);
    return turnsOnTheSpot(some) ? headingSpec(some, visible) : drivenSpec(some, visible);
  }

  function draw() {
    const { axes } = POSE_VIEWS.find((v) => v.key === view());
    const visible = new Set(shown());
    commands.forEach(([command, all], i) => {
      const some = condition() === "all" ? all : all.filter((t) => conditionOf(t) === condition());
      const spec = specOf(some, visible, axes);
      panels[i].show(
        { layers: spec.layers, equal: spec.equal, describe: describeTrial, picked: showDrive,
          x: frame(spec, 0), y: frame(spec, 1) },
        commandName(command),
        some.length ? coverage(some, axes || (spec.rows ? ["y", "theta"] : ["x", "y"])) : "No trials of this condition.",
      );
    });
  }
  draw();
}
