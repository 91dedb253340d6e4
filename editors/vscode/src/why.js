// `ivx why` of a node, as a text to read.
const vscode = require("vscode");
const ivx = require("./ivx");

exports.WHY = "ivx-why";

const changed = new vscode.EventEmitter();

/** Asked again each time that it is shown: what made a result changes with the spec. */
exports.whyText = {
  onDidChange: changed.event,
  provideTextDocumentContent: (uri) => {
    const { spec, node } = JSON.parse(uri.query);
    return ivx.said(["why", vscode.Uri.parse(spec).fsPath, node], vscode.Uri.parse(spec));
  },
};

exports.showWhy = async (spec, node) => {
  if (!spec) return;
  node ??= await vscode.window.showInputBox({
    title: "Why a node runs",
    prompt: "A node, or how its name begins",
    placeHolder: "overoptimisation/model[seed=0]",
  });
  if (!node) return;
  const query = JSON.stringify({ spec: spec.toString(), node });
  // A tab is called for what stands behind the last slash.
  const uri = vscode.Uri.from({ scheme: exports.WHY, path: `why ${node.replaceAll("/", "∕")}`, query });
  changed.fire(uri);
  const text = await vscode.workspace.openTextDocument(uri);
  await vscode.window.showTextDocument(text, { viewColumn: vscode.ViewColumn.Beside, preview: true });
};
