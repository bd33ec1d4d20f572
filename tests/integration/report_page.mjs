// node report_page.mjs CHROMIUM FOLDER: opens the pages of render_example in a headless browser.
// Judges what a reader meets: nothing is blocked or fails, nothing is fetched, the plots are drawn,
// zoomed and taken away, nothing hostile runs, keys work, terms are told where they stand, and a
// phone's width suffices.
// REPORT_PICTURES=folder keeps screenshots for a person.
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { check, end, failures, open, pictures, profile, send } from "./browser.mjs";

const folder = process.argv[3];

// How many plots show marks beyond their axes.
const DRAWN = `[...document.querySelectorAll(".plot .canvas")].filter((plot) =>
  [...plot.querySelectorAll("path")].some((p) => p.getAttribute("d").length > 30)).length`;
const OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth";

async function judge(page, name, plots) {
  const drawn = await page.run(DRAWN);
  check(drawn === plots, `${name}: ${drawn} plots drawn, expected ${plots}`);
  const overflow = await page.run(OVERFLOW);
  check(overflow <= 0, `${name}: ${overflow} px wider than the window`);
  const strange = await page.run(NOT_NUMBERS);
  check(strange === 0, `${name}: ${strange} marks at no place`);
  for (const complaint of page.complaints) check(false, `${name}: ${complaint}`);
}

async function judgeKeys(page) {
  await page.run(`document.querySelector("#pose-plots .canvas").focus()`);
  await page.key("ArrowRight");
  const words = await page.run(`document.querySelector("#pose-plots .readout").textContent`);
  check(/trial \d+/.test(words), `keys: the first arrow reads out "${words}", expected a trial`);
  await page.run(`document.querySelector("button.show:not([hidden])").click()`);
  const against = await page.run(`document.querySelector("#residual-controls select").value`);
  check(against === "time", `keys: the first finding shows "${against}", expected time`);
  await page.run(`document.querySelector("input[value=xy]").click()`);
  await page.run(`document.getElementById("theme").click()`);
  check((await page.run("document.documentElement.dataset.theme")) === "dark", "keys: the theme stays light");
}

// Drawn parts lie within their frames, however the numbers are.
const NOT_NUMBERS = `[...document.querySelectorAll(".chart *")].filter((e) =>
  [...e.attributes].some((a) => /NaN|Infinity|undefined/.test(a.value))).length`;

const CROSSED = `[...document.querySelectorAll(".chart")].filter((chart) => {
  const title = chart.querySelector("text[transform]")?.getBoundingClientRect();
  return title && [...chart.querySelectorAll("text[text-anchor=end]")].some((t) => t.getBoundingClientRect().left < title.right);
}).length`;

// A term is told beside it to who comes with keys, and goes at Escape.
async function judgeTerms(page) {
  await page.run(`document.querySelector("a.term[href='#term-floor']").focus()`);
  const told = await page.run(`document.getElementById("tip").hidden ? "" : document.getElementById("tip").textContent`);
  check(/repeating/.test(told), `terms: floor is told as "${told}"`);
  check((await page.run(OVERFLOW)) <= 0, "terms: the words beside a term widen the page");
  await page.key("Escape");
  check(await page.run(`document.getElementById("tip").hidden`), "terms: Escape leaves the words");
}

// Keys zoom, 0 shows all, a drag shows a part, and the marks omitted are counted.
async function judgeZoom(page) {
  const first = `document.querySelector("#residual-plots .canvas")`;
  const ticks = () => page.run(`[...${first}.querySelectorAll("text")].map((t) => t.textContent).join(" ")`);
  await page.run(`${first}.focus()`);
  const all = await ticks();
  await page.key("+");
  check((await ticks()) !== all, "zoom: plus changes nothing");
  check(/beyond the frame/.test(await page.run(`${first}.parentElement.querySelector(".note").textContent`)),
    "zoom: nothing says what is omitted");
  await page.key("0");
  check((await ticks()) === all, "zoom: 0 does not show all again");
  await page.run(`${first}.scrollIntoView({ block: "center", behavior: "instant" })`);
  const box = await page.run(`(() => { const b = ${first}.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()`);
  const mouse = (type, x, y) => page.call("Input.dispatchMouseEvent",
    { type, x: box[0] + x * box[2], y: box[1] + y * box[3], button: "left", buttons: 1, clickCount: 1 });
  await mouse("mousePressed", 0.4, 0.3);
  await mouse("mouseMoved", 0.6, 0.5);
  await mouse("mouseReleased", 0.7, 0.6);
  check((await ticks()) !== all, "zoom: a drag changes nothing");
  await page.key("0");
}

// Figures, tables and texts can be taken away.
async function judgeCopies(page) {
  const downloads = join(profile, "downloads");
  mkdirSync(downloads, { recursive: true });
  await send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: downloads });
  const take = async (selector, text, name, expected) => {
    await page.run(`[...document.querySelectorAll(${JSON.stringify(selector)})].find((b) => b.textContent === "${text}").click()`);
    const path = join(downloads, name);
    for (let i = 0; i < 100 && !existsSync(path); ++i) await new Promise((done) => setTimeout(done, 50));
    const content = existsSync(path) ? readFileSync(path) : "";
    check(expected.test(content.toString("latin1")), `copies: ${name} is ${content.length} bytes of something else`);
    if (pictures && content) writeFileSync(join(pictures, name), content);
  };
  await take("#floor-plot .tools button", "SVG", "diagnosis-errors-of-the-tuned-model-on-the-floor.svg", /^<svg[^]*<path[^]*<\/svg>/);
  await take("#floor-plot .tools button", "PNG", "diagnosis-errors-of-the-tuned-model-on-the-floor.png", /^.PNG/);
  await take("#residual-plots .tools button", "CSV", "diagnosis-along-x-mm.csv", /^layer,style,[^]*points,tuned,[0-9.]+,-?[0-9.]+/);
  await take("#parameters button.take", "CSV", "parameters.csv", /full_speed[^]*,0.283 m\/s,0.281 to 0.285,/);
  await take("#all-trials", "All trials as CSV", "trials.csv", /^session,trial,command,[^]*charge-1,0,/);
  await page.run(`document.querySelector("button.copy").click()`);
  await page.run("new Promise((done) => setTimeout(done, 100))");
  const said = await page.run(`document.querySelector("button.copy").textContent`);
  check(/^Copied|^Selected/.test(said), `copies: the config's button says "${said}"`);
}

// Long lines cost what a screen can show, log axes have ticks, densities have cells.
async function judgeRenderer(page) {
  const result = await page.run(`(() => {
    const host = document.createElement("div");
    const points = Array.from({ length: 100000 }, (_, i) => [i, i === 70001 ? 1e6 : 10 ** (3 * Math.sin(i / 9000))]);
    const axis = (min, max, log) => ({ min, max, log, label: "v" });
    const began = performance.now();
    const { svg, toY } = drawPlot(host, { x: axis(0, 1e5), y: axis(1e-3, 1e7, true), layers: [
      { kind: "line", style: "final", points },
      { kind: "band", style: "final", points: points.slice(0, 2000).map(([x, y]) => [x, y / 2, 2 * y]) },
      { kind: "cells", style: "final", cells: [[0, 1, 1e4, 10, 0.5]] },
      { kind: "points", style: "final", shape: "dot", points: [[1, -5], [2, NaN]] },
    ] }, 800, 400);
    const d = svg.querySelector("g path").getAttribute("d");
    const ms = performance.now() - began;
    document.body.append(host);
    const crossed = ${CROSSED};
    host.remove();
    return { ms, crossed, length: d.length, peak: d.includes(" " + px(toY(1e6))),
             words: [...svg.querySelectorAll("text")].map((t) => t.textContent).join(" ") };
  })()`);
  if (pictures) console.log(`a line of 100,000 points: ${result.ms.toFixed(0)} ms, a path of ${result.length} characters`);
  check(result.length < 60_000, `renderer: a line of 100,000 points is a path of ${result.length} characters`);
  check(result.peak, "renderer: the one far point of a long line is not drawn");
  check(result.crossed === 0, "renderer: long numbers lie on the axis' title");
  check(/0\.001 .*100/.test(result.words), `renderer: the log axis has the ticks ${result.words}`);
}

// A plot keeps its zoom when its data change, and shows all when another axis is chosen.
async function judgeChoice(page) {
  const ticks = () => page.run(`[...document.querySelectorAll("#progress-plot .canvas text")].map((t) => t.textContent).join(" ")`);
  const choose = (value) => page.run(`(() => { const s = document.querySelector("#progress-controls select");
    s.value = "${value}"; s.dispatchEvent(new Event("change")); })()`);
  await choose("evaluations");
  const all = await ticks();
  await choose("generation");
  await page.run(`document.querySelector("#progress-plot .canvas").focus()`);
  await page.key("+");
  const zoomed = await ticks();
  await page.run("redraws.forEach((draw) => draw())");
  check((await ticks()) === zoomed, "choice: new data take the zoom away");
  await choose("evaluations");
  check((await ticks()) === all, "choice: another axis keeps the zoom of the one before");
  await choose("generation");
}

// A click on the map shows that drive below.
async function judgeDrives(page) {
  await page.run(`document.querySelector("#floor-plot .canvas").focus()`);
  await page.key("ArrowRight");
  const trial = await page.run(`document.querySelector("#floor-plot .readout").textContent`);
  await page.key("Enter");
  const chosen = await page.run(`document.querySelector("#drive-controls p").textContent`);
  check(trial && chosen.startsWith(trial), `drives: ${chosen} is shown for ${trial}`);
}

try {
  const file = (name) => pathToFileURL(join(folder, `${name}.html`)).href;
  const phone = { width: 390, height: 844 };
  for (const [name, path, options, plots] of [
    ["wide", file("example"), {}, 12],
    ["dark", file("example"), { dark: true }, 12],
    ["phone", file("example"), phone, 12],
    ["null", file("null"), {}, 12],
    ["hostile", file("hostile"), phone, 13],
    ["empty", file("empty"), {}, 0],
    ["unusable", file("unusable"), phone, 0],
    ["run", file("run"), {}, 13],
    ["run-phone", file("run"), { ...phone, dark: true }, 13],
    ["run-begun", file("run-begun"), phone, 0],
  ]) {
    const page = await open(path, options);
    await page.picture(name);
    check((await page.run("document.documentElement.dataset.ready")) === "true", `${name}: the scripts did not end`);
    if (name === "hostile") check((await page.run("document.title")).startsWith("</script>"), "hostile: the title is another");
    if (name === "wide" || name === "phone") await judgeTerms(page);
    if (name === "wide") {
      await judgeZoom(page);
      await judgeCopies(page);
      await judgeDrives(page);
      await judgeKeys(page);
    }
    await judge(page, name, plots);
    if (name === "run") {
      await judgeChoice(page);
      await judgeRenderer(page);
    }
    if (name === "wide") await page.picture("wide-error-view");
    if (name === "dark" && pictures) {
      const { data } = await page.call("Page.printToPDF", { printBackground: true });
      writeFileSync(join(pictures, "print.pdf"), Buffer.from(data, "base64"));
    }
    await page.close();
  }
} catch (error) {
  failures.push(error.stack);
} finally {
  await end("report page");
}
