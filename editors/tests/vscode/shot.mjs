// What VS Code shows of a spec: node shot.mjs VSIX SPEC FOLDER PICTURES, beside a VS Code by ./setup.
// The program is $IVX, the browser $CHROMIUM. FOLDER is new, PICTURES is where screenshots go.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const [vsix, spec, folder, pictures] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const server = join(here, "node_modules/code-server/lib/vscode/out/server-main.js");
const patience = 60_000;

// A project with a fault, and VS Code with the extension.
const project = join(folder, "gap");
const file = join(project, "gap.ivx");
mkdirSync(join(project, ".ivx"), { recursive: true });
const good = readFileSync(spec, "utf8");
writeFileSync(file, good.replace("= train(", "= trian("));
const data = join(folder, "data");
mkdirSync(join(data, "data/Machine"), { recursive: true });
const settings = (path) => writeFileSync(join(data, "data/Machine/settings.json"), JSON.stringify({
  "ivx.path": path,
  "workbench.startupEditor": "none",
  "workbench.colorTheme": "Default Light Modern",
  "workbench.tips.enabled": false,
  "chat.disableAIFeatures": true,
  "telemetry.telemetryLevel": "off",
  "workbench.secondarySideBar.defaultVisibility": "hidden",
  "editor.minimap.enabled": false,
  "extensions.autoCheckUpdates": false,
  "files.autoSave": "off",
}));
settings(process.env.IVX);
const vscode = (...args) => [server, "--accept-server-license-terms", "--server-data-dir", data, ...args];
execFileSync(join(here, "node"), vscode("--install-extension", vsix), { stdio: "ignore" });

const port = await new Promise((given) => {
  const free = createServer().listen(0, "127.0.0.1", () => {
    const { port } = free.address();
    free.close(() => given(port));
  });
});
const running = spawn(join(here, "node"), vscode("--host", "127.0.0.1", "--port", port, "--without-connection-token"));
const told = [];
running.stdout.on("data", (text) => told.push(text));
running.stderr.on("data", (text) => told.push(text));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM,
  args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"],
});
const page = await browser.newPage({ viewport: { width: 1100, height: 640 } });
try {
  await until("the server", () => told.join("").includes("Extension host agent listening"));
  await show();
  console.log("ok: VS Code");
} catch (error) {
  await page.screenshot({ path: join(pictures, "vscode-failed.png") });
  console.log(told.join("").slice(-4000));
  throw error;
} finally {
  await browser.close();
  running.kill();
}

async function show() {
  await page.goto(`http://127.0.0.1:${port}/?folder=${project}`, { waitUntil: "domcontentloaded" });
  await page.waitForSelector(".monaco-workbench", { timeout: patience });
  await page.locator(".explorer-folders-view >> text=gap.ivx").dblclick({ timeout: patience });
  await page.waitForSelector(".view-lines", { timeout: patience });

  // A folder that nobody trusts is checked, and a fault underlined, but not run.
  await page.waitForSelector(".squiggly-error", { timeout: patience });
  console.log("ok: squiggle");
  await page.locator(".editor-actions a.disabled[aria-label^='Run Experiment']").waitFor({ timeout: patience });
  await page.locator(".part.banner a", { hasText: "Manage" }).click();
  await page.locator(".workspace-trust-editor a", { hasText: /^Trust$/ }).click();
  await page.keyboard.press("Control+w");
  await page.waitForSelector(".editor-actions a:not(.disabled)[aria-label^='Run Experiment']", { timeout: patience });
  await page.waitForSelector(".squiggly-error", { timeout: patience });
  console.log("ok: trust");

  await page.keyboard.press("Control+b");

  // While a fault is underlined, completion goes on, and so does what an operation does on hover: all of it is the picture.
  // Lenses move the lines, so that one waits for them.
  await page.locator(".codelens-decoration a", { hasText: "run" }).waitFor({ timeout: patience });
  await page.waitForTimeout(1000);
  await word("measure").click();
  await page.keyboard.press("End");
  await page.keyboard.type("\nmeasure gap = ha", { delay: 100 });
  const list = page.locator(".suggest-widget.visible");
  await list.locator(".monaco-list-row", { hasText: "hallucination" }).first().waitFor({ timeout: patience });
  await page.keyboard.press("Control+Space");
  const details = page.locator(".suggest-details:visible", { hasText: "hallucination(decision: Decision" });
  await details.waitFor({ timeout: patience });
  assert.match(await details.innerText(), /The hallucination gap/);
  console.log("ok: completion");
  await word("regret").hover();
  const operation = page.locator(".monaco-hover:visible", { hasText: "regret(decision: Decision" });
  await operation.waitFor({ timeout: patience });
  assert.match(await operation.innerText(), /The optimality gap/);
  await page.waitForTimeout(1500);
  const parts = await Promise.all([word("trian"), operation, list, details].map((part) => part.boundingBox()));
  parts.forEach((part, i) => parts.slice(0, i).forEach((other) => assert(apart(part, other), "each is to be seen")));
  assert(await page.locator(".squiggly-error").count() > 0);
  await page.screenshot({ path: join(pictures, "vscode.png") });
  console.log("ok: hover");
  await page.keyboard.press("Escape");
  await page.keyboard.press("Control+Shift+k");

  // What is wrong is told of on hover.
  await word("trian").hover();
  const hover = page.locator(".monaco-hover:visible", { hasText: "IVX0302" });
  await hover.waitFor({ timeout: patience });
  assert.match(await hover.innerText(), /`?trian`?/);
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(pictures, "vscode-fault.png") });
  console.log("ok: fault on hover");

  // Its mend is a quick fix.
  await hover.locator("a", { hasText: "Quick Fix" }).click();
  const mend = page.locator(".action-widget", { hasText: "did you mean `train`?" });
  await mend.waitFor({ timeout: patience });
  await page.keyboard.press("Enter");
  await page.waitForSelector(".squiggly-error", { state: "detached", timeout: patience });
  await page.keyboard.press("Control+s");
  await until("the mended file", () => readFileSync(file, "utf8") === good);
  console.log("ok: quick fix");

  // A line of `///` goes on as one.
  await word("edition").click();
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("End");
  await page.keyboard.press("Enter");
  await page.keyboard.type("More");
  await page.keyboard.press("Escape");
  await page.keyboard.press("Control+s");
  await until("a comment", () => readFileSync(file, "utf8").includes("\n/// More\nexperiment"));
  console.log("ok: comments go on");

  // There is no report, then a run, and then there is one.
  await page.locator(".editor-actions a[aria-label^='Open Report']").click();
  await page.locator(".notification-toast", { hasText: "run it first" }).waitFor({ timeout: patience });
  await page.keyboard.press("Escape");
  await page.locator(".editor-actions a[aria-label^='Run Experiment']").click();
  const report = join(project, "results/gap/report.html");
  await until("a report", () => existsSync(report));
  await page.locator(".terminal-tabs-entry, .single-terminal-tab", { hasText: /gap\.ivx\b(?!.*object)/ }).waitFor({ timeout: patience });
  console.log("ok: run");
  await page.waitForTimeout(1500);
  await page.screenshot({ path: join(pictures, "vscode-run.png") });
  await page.keyboard.press("Control+j");
  await page.locator(".editor-actions a[aria-label^='Open Report']").click();
  // Of two frames, while a page is replaced, this one is seen.
  const shown = page.frameLocator("iframe.webview").frameLocator("#active-frame");
  await shown.locator("h1", { hasText: "gap" }).waitFor({ timeout: patience });
  await shown.locator("text=doubt is worth hearing").first().waitFor({ timeout: patience });
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(pictures, "vscode-report.png") });
  console.log("ok: report");
  writeFileSync(report, readFileSync(report, "utf8").replace("<h1>", "<h1>again, "));
  await shown.locator("h1", { hasText: "again" }).waitFor({ timeout: patience });
  console.log("ok: the report follows its file");

  // Why, from above a measure.
  await page.locator(".codelens-decoration a", { hasText: "why" }).first().click();
  await page.locator(".tab", { hasText: "why gap" }).waitFor({ timeout: patience });
  await page.locator(".view-lines:visible", { hasText: "nodes begin with" }).waitFor({ timeout: patience });
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(pictures, "vscode-why.png") });
  console.log("ok: why");

  // Without the program it is said how to come by it.
  settings(join(folder, "nothing"));
  await page.locator(".notification-toast", { hasText: "Install ivx, or set" }).waitFor({ timeout: patience });
  console.log("ok: no program");
}

/** A word of the text, as it is drawn. */
function word(text) {
  return page.locator(".editor-instance .view-line span span", { hasText: new RegExp(`^\\W*${text}\\W*$`) }).first();
}

/** Whether neither of two boxes hides more of the other than its border. */
function apart(a, b) {
  const before = (start, size) => a[start] + a[size] <= b[start] + 2 || b[start] + b[size] <= a[start] + 2;
  return before("x", "width") || before("y", "height");
}

async function until(what, holds) {
  for (const end = Date.now() + patience; !holds(); ) {
    if (Date.now() > end) throw new Error(`${what} is waited for`);
    await new Promise((later) => setTimeout(later, 50));
  }
}
