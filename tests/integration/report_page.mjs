// node report_page.mjs CHROMIUM FOLDER: opens the report's pages in a headless browser.
// Judges what a reader meets: nothing is blocked or fails, nothing is fetched, the plots are drawn
// with uPlot and without, nothing hostile runs, keys work, and a phone's width suffices.
// REPORT_PICTURES=folder keeps screenshots for a person.
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [chromium, folder] = process.argv.slice(2);
const profile = mkdtempSync(join(tmpdir(), "report-page-"));
const pictures = process.env.REPORT_PICTURES;
const TIME_LIMIT_MS = 60_000;

const failures = [];
const check = (good, words) => {
  if (!good) failures.push(words);
};

// --- DevTools protocol over a pipe: JSON messages that end with a NUL ---

const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
  "--disable-dev-shm-usage", `--user-data-dir=${profile}`, "--remote-debugging-pipe"];
const browser = spawn(chromium, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
const limit = setTimeout(() => {
  console.error("the browser did not answer in time");
  browser.kill("SIGKILL");
  process.exit(1);
}, TIME_LIMIT_MS);

let lastId = 0;
let rest = "";
const waiting = new Map();
let onEvent = () => {};
browser.stdio[4].setEncoding("utf8");
browser.stdio[4].on("data", (chunk) => {
  const messages = (rest + chunk).split("\0");
  rest = messages.pop();
  for (const text of messages) {
    const message = JSON.parse(text);
    if (message.id) {
      const { resolve, reject } = waiting.get(message.id);
      waiting.delete(message.id);
      if (message.error) reject(new Error(message.error.message));
      else resolve(message.result);
    } else {
      onEvent(message.method, message.params);
    }
  }
});

function send(method, params = {}, sessionId = undefined) {
  const id = ++lastId;
  browser.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}

// --- a page ---

async function open(file, { width = 1280, height = 900, dark = false } = {}) {
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const call = (method, params) => send(method, params, sessionId);
  const complaints = [];
  const url = pathToFileURL(file).href;
  let loaded;
  const load = new Promise((resolve) => { loaded = resolve; });
  onEvent = (method, params) => {
    if (method === "Runtime.exceptionThrown") complaints.push(params.exceptionDetails.exception?.description);
    if (method === "Runtime.consoleAPICalled") complaints.push(`console: ${JSON.stringify(params.args)}`);
    if (method === "Log.entryAdded") complaints.push(params.entry.text);
    if (method === "Page.loadEventFired") loaded();
    if (method === "Network.requestWillBeSent" && params.request.url !== url && !params.request.url.startsWith("data:")) {
      complaints.push(`request for ${params.request.url}`);
    }
  };
  for (const domain of ["Page", "Runtime", "Log", "Network"]) await call(`${domain}.enable`);
  await call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: width < 600 });
  await call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
  await call("Page.navigate", { url });
  await load;
  const page = {
    complaints,
    call,
    async run(expression) {
      const { result, exceptionDetails } = await call("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
      if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description}`);
      return result.value;
    },
    async key(key) {
      for (const type of ["keyDown", "keyUp"]) await call("Input.dispatchKeyEvent", { type, key, code: key });
    },
    async picture(name) {
      if (!pictures) return;
      const { data } = await call("Page.captureScreenshot", { captureBeyondViewport: true, format: "png" });
      writeFileSync(join(pictures, `${name}.png`), Buffer.from(data, "base64"));
    },
    close: () => send("Target.closeTarget", { targetId }),
  };
  // Two frames, so that observers of sizes have run and the plots are drawn.
  await page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))");
  return page;
}

// How many plots show marks beyond their ground: canvases with several colours, or SVG paths.
const DRAWN = `[...document.querySelectorAll(".plot .canvas")].map((plot) => {
  const canvas = plot.querySelector("canvas");
  if (!canvas) return [...plot.querySelectorAll("path")].filter((p) => p.getAttribute("d").length > 50).length;
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const colours = new Set();
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200) colours.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
  return colours.size;
}).filter((n) => n > 1).length`;
const OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth";

async function judge(page, name, plots) {
  const drawn = await page.run(DRAWN);
  check(drawn === plots, `${name}: ${drawn} plots drawn, expected ${plots}`);
  const overflow = await page.run(OVERFLOW);
  check(overflow <= 0, `${name}: ${overflow} px wider than the window`);
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

const fallback = join(profile, "fallback.html");
writeFileSync(fallback, readFileSync(join(folder, "example.html"), "utf8").replace(/<script>\/\*\nThe MIT[^]*?<\/script>/, ""));

try {
  const file = (name) => join(folder, `${name}.html`);
  for (const [name, path, options, plots] of [
    ["wide", file("example"), {}, 9],
    ["dark", file("example"), { dark: true }, 9],
    ["phone", file("example"), { width: 390, height: 844 }, 9],
    ["svg", fallback, {}, 9],
    ["null", file("null"), {}, 9],
    ["hostile", file("hostile"), { width: 390, height: 844 }, 10],
    ["empty", file("empty"), {}, 0],
  ]) {
    const page = await open(path, options);
    await page.picture(name);
    const ready = await page.run("document.documentElement.dataset.ready");
    if (name === "svg") check(ready === "svg", `svg: drawn with ${ready}`);
    if (name === "hostile") check((await page.run("document.title")).startsWith("</script>"), "hostile: the title is another");
    if (name === "wide") await judgeKeys(page);
    await judge(page, name, plots);
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
  clearTimeout(limit);
  const gone = new Promise((resolve) => { browser.once("exit", resolve); });
  browser.kill();
  await gone;
  rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
}
for (const failure of failures) console.error(`FAILED ${failure}`);
console.log(failures.length ? `${failures.length} failures` : "report page: fine");
process.exitCode = failures.length ? 1 : 0;
