"use strict";
// The shape of what nothing explains: the shifts of each term of the correction, as arrows over the
// floor or as curves over whatever else they depend on.

const SHAPE_LABEL = {
  x: "x of the world, m", y: "y of the world, m", heading: "heading, rad", time: "time in the session, s",
  duration: "duration, s", level: "greater duty", left: "left duty", right: "right duty",
  left_reversed: "left side changes its direction", right_reversed: "right side changes its direction",
  moved: "put down by hand just before",
};
const SHAPE_CYCLIC = new Set(["heading"]);
const MOST_LINES = 4;  // of values of a second covariate

// The shift at `z`, one number a covariate: [x, y, heading] in m, m, rad.
function shiftAt(term, weights, z) {
  const sum = [0, 0, 0];
  term.centres.forEach((centre, k) => {
    let d2 = 0;
    term.covariates.forEach((name, j) => {
      const away = z[j] - centre[j];
      d2 += ((SHAPE_CYCLIC.has(name) ? 2 * Math.sin(away / 2) : away) / term.lengths[j]) ** 2;
    });
    const bump = Math.exp(-d2 / 2);
    weights[k].forEach((w, c) => { sum[c] += bump * w; });
  });
  return sum;
}

// From the least centre to the greatest; a whole turn of what comes back to itself.
function reachOf(term, j) {
  if (SHAPE_CYCLIC.has(term.covariates[j])) return { min: -Math.PI, max: Math.PI };
  const values = term.centres.map((centre) => centre[j]);
  const [min, max] = extent(values);
  return max > min ? { min, max } : { min: min - 1, max: max + 1 };
}

const middleOf = (term) => term.covariates.map((_, j) => {
  const values = distinct(term.centres.map((centre) => centre[j]));
  return values[Math.floor(values.length / 2)];
});

// Shares are reported in per cent, shifts in mm and mrad.
const shownFactor = (term) => (term.frame === "motion" ? 100 : 1000);
const unitOf = (term, part) => (term.frame === "motion" ? "%" : UNIT[part]);
const shapePer = (term) => (term.by_drive ? "for a second at full duty" : "a trial");
const shapeFrame = (term) => ({
  robot: "x is ahead of the robot, y to its left",
  world: "in the world's axes",
  motion: "of the motion's own parts ahead, to the left and in turning",
  readings: "of a pose that is read there; a drive is off by its end's less its start's",
})[term.frame];

// --- over the floor ---

function floorShape(term, weights) {
  const [jx, jy] = [term.covariates.indexOf("x"), term.covariates.indexOf("y")];
  const [x, y] = [reachOf(term, jx), reachOf(term, jy)];
  const z = middleOf(term);
  const shifts = spaced(x, 12).flatMap((px) => spaced(y, 12).map((py) => {
    z[jx] = px;
    z[jy] = py;
    return [px, py, ...shiftAt(term, weights, z)];
  }));
  const lengths = shifts.map(([, , dx, dy]) => Math.hypot(dx, dy));
  const longest = Math.max(...lengths, 1e-9);
  const times = roundBelow(Math.max(1e-3, (x.max - x.min) / 11 / longest));
  const turns = Math.max(...shifts.map((s) => Math.abs(s[4])), 1e-12);
  const scale = (turn) => Math.min(4, Math.floor((5 * Math.abs(turn)) / turns));
  const layers = [];
  for (let i = 0; i < 5; ++i) {
    const arrows = shifts.filter((s) => (term.frame === "readings" ? 1 : scale(s[4])) === i)
      .map(([px, py, dx, dy]) => [px, py, px + times * dx, py + times * dy]);
    if (arrows.length) layers.push({ kind: "arrows", style: `scale-${i}`, width: 1.6, head: 6, arrows, name: `shift times ${times}` });
  }
  const colours = term.frame === "readings" ? "" : ` Colours: turned by up to ${numberText(shownFactor(term) * turns, 2)} ${unitOf(term, "theta")}.`;
  return [{
    spec: { x: { ...roomy(x.min, x.max, 0.08), label: SHAPE_LABEL.x }, y: { ...roomy(y.min, y.max, 0.08), label: SHAPE_LABEL.y }, equal: true, layers },
    title: "Shift over the floor",
    note: `Up to ${numberText(shownFactor(term) * longest, 2)} ${unitOf(term, "x")} ${shapePer(term)}, drawn ${times === 1 ? "to scale" : `${numberText(times, 2)} times as long`}; ${shapeFrame(term)}.${colours}`,
  }];
}

// --- along one covariate, a line for each of a few values of the next ---

function curveShape(term, weights) {
  const reach = reachOf(term, 0);
  const seconds = term.covariates.length > 1 ? distinct(term.centres.map((c) => c[1])) : [0];
  const every = Math.ceil(seconds.length / MOST_LINES);
  const kept = seconds.filter((_, i) => i % every === 0);
  const parts = term.frame === "readings" ? ["x", "y"] : AXES;
  return parts.map((part, c) => {
    const lines = kept.map((second, i) => {
      const z = middleOf(term);
      if (term.covariates.length > 1) z[1] = second;
      const points = spaced(reach, 60).map((v) => {
        z[0] = v;
        return [v, shownFactor(term) * shiftAt(term, weights, z)[c]];
      });
      const name = term.covariates.length > 1 ? `${SHAPE_LABEL[term.covariates[1]].split(",")[0]} ${numberText(second, 2)}` : "shift";
      return { line: { kind: "line", style: kept.length > 1 ? `scale-${i}` : "final", width: 2.2, points, name }, name };
    });
    const values = lines.flatMap(({ line }) => line.points.map((p) => p[1]));
    const labels = kept.length > 1
      ? lines.map(({ line, name }) => ({ kind: "text", style: line.style, text: name, anchor: "end", points: [line.points.at(-1)] })) : [];
    return {
      spec: { x: { ...reach, label: SHAPE_LABEL[term.covariates[0]] },
              y: { ...robustLimits([], [0, ...values]), label: `${COMPONENT[part]}, ${unitOf(term, part)}` },
              layers: [{ kind: "line", style: "quiet", width: 1, points: [[reach.min, 0], [reach.max, 0]] },
                       ...lines.map(({ line }) => line), ...labels] },
      title: `Shift ${COMPONENT[part]}, ${unitOf(term, part)}`,
      note: `${shapePer(term)}; ${shapeFrame(term)}.`,
    };
  });
}

function startShape() {
  const controls = document.getElementById("shape-controls");
  if (!controls) return;
  const parent = document.getElementById("shape-plots");
  const { terms } = PAGE.residual;
  const panels = [];
  const which = choice(controls, "Term", terms.map((t, i) =>
    [String(i), `${i + 1}: by ${t.covariates.map((name) => SHAPE_LABEL[name].split(",")[0]).join(" and ")}`]), draw);
  const command = choice(controls, "Command",
    [...new Set(terms.flatMap((t) => Object.keys(t.weights)))].map((c) => [c, commandName(c)]), draw);

  function draw() {
    const term = terms[Number(which())];
    const named = Object.keys(term.weights);
    if (!named.includes(command())) command.set(named[0]);
    const weights = term.weights[command()];
    const floor = term.covariates.includes("x") && term.covariates.includes("y");
    const figures = floor ? floorShape(term, weights) : curveShape(term, weights);
    while (panels.length < figures.length) panels.push(new Chart(parent, 0.8));
    panels.forEach((panel, i) => {
      panel.figure.hidden = i >= figures.length;
      panel.figure.classList.toggle("large", floor);
      if (i < figures.length) panel.show(figures[i].spec, figures[i].title, figures[i].note);
    });
  }
  draw();
}
