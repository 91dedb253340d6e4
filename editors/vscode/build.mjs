// Makes out/: the extension in one file, and what it shares with the rest of the repository.
import { build } from "esbuild";
import { copyFileSync, existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";

mkdirSync("out", { recursive: true });
copyFileSync("../ivx.tmLanguage.json", "out/ivx.tmLanguage.json");
for (const license of ["LICENSE-MIT", "LICENSE-APACHE"]) {
  copyFileSync(`../../${license}`, `out/${license}`);
}

const picture = "../../docs/pictures/vscode.png";
let readme = readFileSync("README.md", "utf8");
if (existsSync(picture)) {
  copyFileSync(picture, "out/vscode.png");
  readme = readme.replace(picture, "out/vscode.png");
} else {
  readme = readme.replace(/^!\[.*\]\(.*\)\n\n/m, "");
}
writeFileSync("out/README.md", readme);

await build({
  entryPoints: ["src/main.js"],
  outfile: "out/main.js",
  bundle: true,
  minify: true,
  platform: "node",
  format: "cjs",
  target: "node18",
  external: ["vscode"],
});
