// A headless browser over its DevTools protocol (JSON messages that end with a NUL, over a pipe).
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export const pictures = process.env.REPORT_PICTURES;  // a folder that keeps screenshots for a person
export const profile = mkdtempSync(join(tmpdir(), "report-page-"));
const TIME_LIMIT_MS = 600_000;  // on a machine with many other things to do

export const failures = [];
export const check = (good, words) => {
  if (!good) failures.push(words);
};

const chromium = process.argv[2];
const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
  "--disable-dev-shm-usage", `--user-data-dir=${profile}`, "--remote-debugging-pipe"];
const browser = spawn(chromium, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
const limit = setTimeout(() => {
  for (const failure of failures) console.error(`FAILED ${failure}`);
  console.error("the browser did not answer in time");
  browser.kill("SIGKILL");
  process.exit(1);
}, TIME_LIMIT_MS);

let lastId = 0;
let rest = "";
const waiting = new Map();
const listeners = new Map();  // by session
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
      listeners.get(message.sessionId)?.(message.method, message.params);
    }
  }
});

export function send(method, params = {}, sessionId = undefined) {
  const id = ++lastId;
  browser.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}

// What some keys do depends on their numbers, or on what they write.
const KEYS = { Tab: [9], Enter: [13, "\r"], Escape: [27], " ": [32, " "], End: [35], Home: [36], ArrowLeft: [37], ArrowUp: [38], ArrowRight: [39], ArrowDown: [40] };

// --- a page ---

// `may` says which requests beside the page itself are fine.
export async function open(url, { width = 1280, height = 900, dark = false, scripts = true, may = () => false } = {}) {
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const call = (method, params) => send(method, params, sessionId);
  const complaints = [];
  let loaded;
  const load = new Promise((resolve) => { loaded = resolve; });
  listeners.set(sessionId, (method, params) => {
    if (method === "Runtime.exceptionThrown") complaints.push(params.exceptionDetails.exception?.description);
    if (method === "Runtime.consoleAPICalled") complaints.push(`console: ${JSON.stringify(params.args)}`);
    if (method === "Log.entryAdded") complaints.push(params.entry.text);
    if (method === "Page.loadEventFired") loaded();
    if (method === "Network.requestWillBeSent" && params.request.url !== url && !params.request.url.startsWith("data:") && !may(params.request.url)) {
      complaints.push(`request for ${params.request.url}`);
    }
  });
  for (const domain of ["Page", "Runtime", "Log", "Network"]) await call(`${domain}.enable`);
  await call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: width < 600 });
  await call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
  if (!scripts) await call("Emulation.setScriptExecutionDisabled", { value: true });
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
    async key(key, modifiers = 0) {
      const [windowsVirtualKeyCode, text] = KEYS[key] || [0, key.length === 1 ? key : undefined];
      for (const type of ["keyDown", "keyUp"]) {
        await call("Input.dispatchKeyEvent", { type, key, code: key, modifiers, windowsVirtualKeyCode, text: type === "keyDown" ? text : undefined });
      }
    },
    async picture(name) {
      if (!pictures) return;
      const { data } = await call("Page.captureScreenshot", { captureBeyondViewport: true, format: "png" });
      writeFileSync(join(pictures, `${name}.png`), Buffer.from(data, "base64"));
    },
    close: () => send("Target.closeTarget", { targetId }),
  };
  if (!scripts) return page;
  // Two frames, so that observers of sizes have run and the plots are drawn.
  await page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))");
  return page;
}

// How the program ends: with everything of the browser gone.
export async function end(name) {
  clearTimeout(limit);
  const gone = new Promise((resolve) => { browser.once("exit", resolve); });
  send("Browser.close").catch(() => browser.kill());
  await gone;
  // Its children may write into the profile for a moment longer.
  for (let tries = 1; ; ++tries) {
    try {
      rmSync(profile, { recursive: true, force: true });
      break;
    } catch (error) {
      if (tries === 50) throw error;
      await new Promise((again) => { setTimeout(again, 100); });
    }
  }
  for (const failure of failures) console.error(`FAILED ${failure}`);
  console.log(failures.length ? `${failures.length} failures` : `${name}: fine`);
  process.exitCode = failures.length ? 1 : 0;
}
