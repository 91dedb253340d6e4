// The program `ivx`.
const { execFile } = require("node:child_process");
const { dirname } = require("node:path");
const vscode = require("vscode");

exports.path = () => vscode.workspace.getConfiguration("ivx").get("path");

/** What to tell where there is no `ivx`, or one without a language server. */
exports.missing = async (path) => {
  const { error } = await call(path, ["lsp", "--help"], {});
  if (!error) return undefined;
  if (error.code === "ENOENT" || error.code === "EACCES") {
    return `There is no program \`${path}\`. Install ivx, or set \`ivx.path\` to where it is.`;
  }
  return `\`${path}\` has no language server: it may be too old, or another program of that name.`;
};

/** What `ivx` says of a spec, or why it says nothing. */
exports.said = async (args, spec) => {
  const { error, stdout, stderr } = await call(exports.path(), args, { cwd: dirname(spec.fsPath) });
  return error ? stdout + (stderr || error.message) : stdout;
};

function call(path, args, options) {
  const all = { maxBuffer: 1 << 28, env: { ...process.env, NO_COLOR: "1" }, ...options };
  return new Promise((done) => {
    execFile(path, args, all, (error, stdout, stderr) => done({ error, stdout, stderr }));
  });
}
