// `ivx exec` of a spec, in a terminal.
const { homedir } = require("node:os");
const vscode = require("vscode");
const ivx = require("./ivx");

/** Runs the whole spec, of which the experiment's name only tells where it was begun. */
exports.run = async (spec, ...names) => {
  if (!spec) return;
  // The title bar adds what it knows of itself.
  const [experiment, profile] = names.map((name) => (typeof name === "string" ? name : undefined));
  if (!vscode.workspace.isTrusted) {
    vscode.window.showWarningMessage("A spec may run programs: trust this workspace first.");
    return;
  }
  const text = vscode.workspace.textDocuments.find((text) => text.uri.toString() === spec.toString());
  if (text?.isDirty && !(await text.save())) return;
  const args = ["exec", spec.fsPath, ...(profile ? ["--profile", profile] : [])];
  const name = [vscode.workspace.asRelativePath(spec), experiment, profile].filter(Boolean).join(" ");
  // A spec that is opened alone has no folder, and a terminal without one starts at home or not at all.
  const folder = vscode.workspace.getWorkspaceFolder(spec);
  const cwd = folder?.uri.fsPath ?? homedir();
  const task = new vscode.Task(
    { type: "ivx", spec: spec.fsPath, profile },
    folder ?? vscode.TaskScope.Workspace,
    name,
    "ivx",
    new vscode.ProcessExecution(ivx.path(), args, { cwd }),
    [],
  );
  task.presentationOptions = { clear: true, showReuseMessage: false };
  await vscode.tasks.executeTask(task);
};
