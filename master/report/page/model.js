"use strict";
// The data of the page, decoded, and the arithmetic that the plots share.  Lengths in mm, angles
// in mrad unless a name says otherwise.

const readJson = (id) => JSON.parse(document.getElementById(id).textContent);
const wrapped = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
const degrees = (angle) => (angle * 180) / Math.PI;

// Rows of the trials table as objects with the columns' names.
function readTrials() {
  const { columns, rows } = readJson("trials");
  const trials = rows.map((row) => Object.fromEntries(columns.map((name, i) => [name, row[i]])));
  const sessions = [...new Set(trials.map((t) => t.session))];
  for (const trial of trials) trial.session_index = sessions.indexOf(trial.session) + 1;
  return trials;
}

// What the page is of, "diagnosis" or "run", and how it calls the two models of each trial.
const PAGE = readJson("page");
const MODELS = ["tuned", "final"];
const MODEL_NAME = PAGE.models;
const SHAPE = { measured: "cross", tuned: "diamond", final: "dot" };
const AXES = ["x", "y", "theta"];
const UNIT = { x: "mm", y: "mm", theta: "mrad" };
const COMPONENT = { x: "along x", y: "along y", theta: "heading" };

// What residuals may be drawn against.  `matches` finds the covariate in a finding's own words.
const COVARIATES = [
  { key: "time", label: "time in the session, min", matches: /time/, of: (t) => t.session_time_s / 60 },
  { key: "heading", label: "start heading, degrees", matches: /head/,
    of: (t) => degrees(t.start_theta) },
  { key: "place", label: "place in the run", matches: /place in|run/, of: (t) => t.place_in_run },
  { key: "level", label: "level, duty", matches: /level|duty/, of: (t) => t.level },
  { key: "duration", label: "duration, s", matches: /duration/, of: (t) => t.duration_s },
  { key: "start_x", label: "start x, m", matches: /\bx\b/, of: (t) => t.start_x },
  { key: "start_y", label: "start y, m", matches: /\by\b/, of: (t) => t.start_y },
  { key: "radius", label: "distance from the origin, m", matches: /radius|distance/,
    of: (t) => Math.hypot(t.start_x, t.start_y) },
  { key: "session", label: "session", matches: /session/, of: (t) => t.session_index },
];

// What a diagnosis brings of its own; of something else than driven motions, in place of these.
const PICTURES = PAGE.pictures?.x ? PAGE.pictures : undefined;
const SHOWN = (PAGE.pictures?.shown ?? []).map(({ key, label, matches }) => (
  { key, label, matches: new RegExp(matches), of: (t) => t[key] }));
if (PICTURES) {
  COMPONENT.x = PICTURES.x;
  COMPONENT.y = PICTURES.y;
  COVARIATES.splice(0, COVARIATES.length, ...COVARIATES.filter((c) => c.key === "session"));
}
COVARIATES.unshift(...SHOWN);

const covariateOf = (text) => (text ? COVARIATES.find((c) => c.matches.test(text.toLowerCase())) : undefined);

const mean = (list) => list.reduce((sum, v) => sum + v, 0) / list.length;

function quantile(sorted, share) {
  const at = share * (sorted.length - 1);
  const low = Math.floor(at);
  const high = Math.min(low + 1, sorted.length - 1);
  return sorted[low] + (at - low) * (sorted[high] - sorted[low]);
}

function groupBy(list, key) {
  const groups = new Map();
  for (const item of list) {
    const k = key(item);
    if (!groups.has(k)) groups.set(k, []);
    groups.get(k).push(item);
  }
  return groups;
}

// The 2 x 2 block of a covariance for two of "x", "y", "theta", as [aa, ab, bb].
function block(trial, model, a, b) {
  const entry = (p, q) => {
    const [first, second] = AXES.indexOf(p) <= AXES.indexOf(q) ? [p, q] : [q, p];
    return trial[`${model}_cov_${first[0]}${second[0]}`];
  };
  return [entry(a, a), entry(a, b), entry(b, b)];
}

const CHI2_90 = 4.605170185988092; // two degrees of freedom

// Points around the 90 % ellipse of a Gaussian with mean (mx, my) and covariance [xx, xy, yy].
function ellipse([mx, my], [xx, xy, yy], steps = 60) {
  const middle = (xx + yy) / 2;
  const offset = Math.hypot((xx - yy) / 2, xy);
  const angle = Math.atan2(2 * xy, xx - yy) / 2;
  const a = Math.sqrt(CHI2_90 * Math.max(middle + offset, 0));
  const b = Math.sqrt(CHI2_90 * Math.max(middle - offset, 0));
  return Array.from({ length: steps + 1 }, (_, i) => {
    const t = (2 * Math.PI * i) / steps;
    const u = a * Math.cos(t);
    const v = b * Math.sin(t);
    return [mx + u * Math.cos(angle) - v * Math.sin(angle), my + u * Math.sin(angle) + v * Math.cos(angle)];
  });
}

// Whether (dx, dy) lies in the 90 % ellipse of [xx, xy, yy].
function inside(dx, dy, [xx, xy, yy]) {
  const det = xx * yy - xy * xy;
  return det > 0 && (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / det <= CHI2_90;
}

// Mean and covariance of an equal mixture of Gaussians: covariances' mean plus means' covariance.
function mixture(means, covs) {
  const mx = mean(means.map((m) => m[0]));
  const my = mean(means.map((m) => m[1]));
  const cov = [0, 1, 2].map((k) => mean(covs.map((c) => c[k])));
  cov[0] += mean(means.map((m) => (m[0] - mx) ** 2));
  cov[1] += mean(means.map((m) => (m[0] - mx) * (m[1] - my)));
  cov[2] += mean(means.map((m) => (m[1] - my) ** 2));
  return { mean: [mx, my], cov };
}

// [xx, xy, yy] seen from axes turned by `angle`.
function turned([xx, xy, yy], angle) {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return [
    c * c * xx - 2 * c * s * xy + s * s * yy,
    c * s * (xx - yy) + (c * c - s * s) * xy,
    s * s * xx + 2 * c * s * xy + c * c * yy,
  ];
}

// The pose B of A's frame, in the frame that A's pose is reported in.
function composed(a, b) {
  const [c, s] = [Math.cos(a.theta), Math.sin(a.theta)];
  return { x: a.x + c * b.x - s * b.y, y: a.y + s * b.x + c * b.y, theta: wrapped(a.theta + b.theta) };
}

const poseOf = (trial, name) => ({ x: trial[`${name}_x`], y: trial[`${name}_y`], theta: trial[`${name}_theta`] });
