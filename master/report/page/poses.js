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
  const r = (model, a) => words(1000 * trial[`${model}_residual_${a}`], 2);
  const error = (model) => `${r(model, "x")}, ${r(model, "y")} mm, ${r(model, "theta")} mrad`;
  return (
    `${trial.session}, trial ${trial.trial}, ${commandName(trial.command)}` +
    `${PICTURES ? "" : ` ${words(trial.duration_s)} s at ${words(trial.level)}`}${trial.held_out ? ", held out" : ""}: off by ${error("tuned")} (tuned), ` +
    `${error("final")} (final)`
  );
}

// Limits around points along one axis, with a margin.
function limits(points, k) {
  const values = points.map((p) => p[k]).filter(isNumber);
  const min = Math.min(...values);
  const max = Math.max(...values);
  const margin = 0.06 * (max - min) || 1;
  return values.length ? { min: min - margin, max: max + margin } : { min: -1, max: 1 };
}

// A push is a condition of its own: there is no choosing among them.
const conditionOf = (t) => (PICTURES ? "all" : `${words(t.duration_s)} s at duty ${words(t.level)}`);

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
  return { layers, labels: ["x, mm", "y, mm"], equal: true };
}

function errorSpec(trials, shown, [a, b]) {
  const layers = [{ kind: "points", shape: "cross", style: "quiet", points: [[0, 0]] }];
  const ellipses = [];
  for (const model of MODELS.filter((m) => shown.has(m))) {
    const at = (t) => [1000 * t[`${model}_residual_${a}`], 1000 * t[`${model}_residual_${b}`]];
    if (shown.has("measured")) {
      layers.push({ kind: "points", shape: model === "tuned" ? "diamond" : "dot", style: model,
                    points: trials.map((t) => [...at(t), t]), faint: true });
    }
    const cov = mixture(trials.map(() => [0, 0]), trials.map((t) => block(t, model, a, b).map((v) => 1e6 * v))).cov;
    ellipses.push({ kind: "line", style: model, points: ellipse([0, 0], cov), dashed: model === "tuned", width: 2.5 });
  }
  layers.push(...ellipses);
  for (const { style, points } of ellipses) {
    const end = points.reduce((top, p) => (style === "tuned" ? p[1] > top[1] : p[1] < top[1]) ? p : top);
    layers.push({ kind: "text", style, points: [end], text: style, anchor: "middle", below: style === "final" });
  }
  return { layers, labels: [a, b].map((k) => `${COMPONENT[k]}, ${UNIT[k]}`), equal: b !== "theta" };
}

// "Inside the 90 % ellipse: tuned 71 %, final 89 %", each trial against its own prediction.
function coverage(trials, [a, b]) {
  const share = (model) =>
    mean(trials.map((t) =>
      inside(t[`${model}_residual_${a}`], t[`${model}_residual_${b}`], block(t, model, a, b)) ? 100 : 0));
  return `${trials.length} trials; inside their 90 % ellipse: tuned ${words(share("tuned"), 2)} %, ` +
    `final ${words(share("final"), 2)} %`;
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

  function draw() {
    const { axes } = POSE_VIEWS.find((v) => v.key === view());
    const visible = new Set(shown());
    commands.forEach(([command, all], i) => {
      const some = condition() === "all" ? all : all.filter((t) => conditionOf(t) === condition());
      const spec = axes ? errorSpec(some, visible, axes) : drivenSpec(some, visible);
      const points = spec.layers.flatMap((l) => l.points);
      panels[i].show(
        { layers: spec.layers, equal: spec.equal, describe: describeTrial,
          x: { ...limits(points, 0), label: spec.labels[0] },
          y: { ...limits(points, 1), label: spec.labels[1] } },
        commandName(command),
        some.length ? coverage(some, axes || ["x", "y"]) : "no trials of this condition",
      );
    });
  }
  draw();
}
