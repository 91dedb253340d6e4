// Specs of ivx in VS Code: a client of `ivx lsp`, and the commands run, why and report.
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");
const { missing } = require("./ivx");
const { openReport, readAgain } = require("./report");
const { run } = require("./run");
const { showWhy, whyText, WHY } = require("./why");

let client;

exports.activate = async (context) => {
  const { registerCommand } = vscode.commands;
  context.subscriptions.push(
    registerCommand("ivx.run", (spec, ...names) => run(of(spec), ...names)),
    registerCommand("ivx.why", (spec, node) => showWhy(of(spec), node)),
    registerCommand("ivx.report", (spec) => openReport(of(spec), client)),
    registerCommand("ivx.restart", restart),
    vscode.workspace.registerTextDocumentContentProvider(WHY, whyText),
    vscode.workspace.onDidChangeConfiguration((e) => e.affectsConfiguration("ivx.path") && restart()),
    vscode.tasks.onDidEndTaskProcess(ended),
  );
  await start();
};

exports.deactivate = stop;

/** The spec that a command is about: code lenses name it, the title bar does, else the editor's. */
function of(spec) {
  if (typeof spec === "string") return vscode.Uri.parse(spec);
  return spec ?? vscode.window.activeTextEditor?.document.uri;
}

async function start() {
  const path = vscode.workspace.getConfiguration("ivx").get("path");
  const trouble = await missing(path);
  if (trouble) return tell(trouble);
  client = new LanguageClient(
    "ivx",
    "ivx",
    { command: path, args: ["lsp"] },
    { documentSelector: [{ language: "ivx", scheme: "file" }] },
  );
  // The client tells of its own why it does not start. Running a spec does not need it.
  await client.start().catch(() => undefined);
}

async function stop() {
  const last = client;
  client = undefined;
  await last?.dispose();
}

async function restart() {
  await stop();
  await start();
}

/** After a run that ended well its report is read again, and the server hears of results, wherever they lie. */
function ended({ execution, exitCode }) {
  const { type, spec } = execution.task.definition;
  if (type !== "ivx" || exitCode !== 0) return;
  const uri = vscode.Uri.file(spec).toString();
  readAgain(uri);
  client?.sendNotification("workspace/didChangeWatchedFiles", { changes: [{ uri, type: 2 }] }).catch(() => undefined);
}

// Not awaited: nothing waits for what a person answers.
function tell(trouble) {
  vscode.window.showErrorMessage(trouble, "Open Settings", "Try Again").then((answer) => {
    if (answer === "Open Settings") vscode.commands.executeCommand("workbench.action.openSettings", "ivx.path");
    if (answer === "Try Again") restart();
  });
}
