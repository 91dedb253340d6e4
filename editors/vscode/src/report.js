// The report of a spec beside its text. It is one page without scripts, which holds all that it shows.
const { readFile } = require("node:fs/promises");
const { unwatchFile, watchFile } = require("node:fs");
const { basename } = require("node:path");
const vscode = require("vscode");

/** Of each spec whose report is open, how to read it again. */
const open = new Map();

exports.openReport = async (spec, client) => {
  if (!spec) return;
  const key = spec.toString();
  if (open.has(key)) return open.get(key).show();
  const path = await place(key, client);
  if (!path) {
    const answer = await vscode.window.showInformationMessage(
      `There is no report of ${basename(spec.fsPath)} yet: run it first.`, "Run");
    if (answer === "Run") vscode.commands.executeCommand("ivx.run", spec);
    return;
  }
  const panel = vscode.window.createWebviewPanel(
    "ivx.report",
    `Report of ${basename(spec.fsPath)}`,
    { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
    { enableScripts: false, enableFindWidget: true, localResourceRoots: [] },
  );
  let shown;
  // A run replaces the whole folder: a report that cannot be read is on its way.
  const read = async () => {
    const html = await readFile(path, "utf8").catch(() => shown);
    if (html !== shown) panel.webview.html = shown = html;
  };
  // By looking rather than by events, which do not survive that the folder is replaced.
  watchFile(path, { interval: 1000 }, read);
  open.set(key, { read, show: () => panel.reveal(undefined, true) });
  panel.onDidDispose(() => {
    unwatchFile(path, read);
    open.delete(key);
  });
  await read();
};

exports.readAgain = (spec) => open.get(spec)?.read();

/** Where the report lies, which the server knows; nowhere where it has none or does not know. */
async function place(uri, client) {
  const answer = await client?.sendRequest("ivx/report", { uri }).catch(() => undefined);
  return answer?.path;
}
