-- What Neovim shows of a spec: nvim --headless --clean -l nvim.lua EDITORS FOLDER SNIPPET
-- EDITORS/README.md says how Neovim is told of `ivx`: its SNIPPETth block of Lua is what runs here.
local editors, folder, snippet = unpack(vim.tbl_map(function(i) return _G.arg[i] end, { 1, 2, 3 }))

local blocks = {}
for block in table.concat(vim.fn.readfile(editors .. "/README.md"), "\n"):gmatch("```lua\n(.-)```") do
  table.insert(blocks, block)
end
assert(#blocks == 3, "README.md has a block of 0.11, an older one, and that of code lenses")
assert(load(blocks[tonumber(snippet)]))()
assert(load(blocks[3]))()

local good = vim.fn.readfile(editors .. "/tests/gap.ivx")
local function wrong(old, new)
  return vim.split((table.concat(good, "\n"):gsub(vim.pesc(old), (new:gsub("%%", "%%%%")))), "\n")
end
local path = folder .. "/gap.ivx"
vim.fn.mkdir(folder .. "/.ivx", "p")
vim.fn.writefile(wrong("= train(", "= trian("), path)
vim.cmd.edit(path)
assert(vim.bo.filetype == "ivx", "the file type")

local function wait(what, until_)
  if not vim.wait(10000, until_, 20) then
    error(what .. " is waited for; faults: " .. vim.inspect(vim.diagnostic.get(0)))
  end
end
local function equal(what, found, expected)
  assert(vim.deep_equal(found, expected), what .. ": " .. vim.inspect(found) .. ", not " .. vim.inspect(expected))
  print("ok: " .. what)
end

-- A fault, at its place, and its mend.
wait("a fault", function() return #vim.diagnostic.get(0) == 1 end)
local fault = vim.diagnostic.get(0)[1]
equal("a fault", { fault.code, fault.source, fault.lnum, fault.col, fault.end_col }, { "IVX0302", "ivx", 8, 16, 21 })
local client = vim.lsp.get_clients({ bufnr = 0 })[1]
-- On some systems a folder of temporary files is a link.
equal("the project", vim.uv.fs_realpath(client.root_dir), vim.uv.fs_realpath(folder))

vim.api.nvim_win_set_cursor(0, { 9, 17 })
vim.lsp.buf.code_action({ apply = true, filter = function(a) return a.title:find("did you mean `train`?", 1, true) == 1 end })
wait("the mend", function() return vim.api.nvim_buf_get_lines(0, 8, 9, true)[1] == "    let model = train(" end)
wait("no fault", function() return #vim.diagnostic.get(0) == 0 end)
equal("mended", vim.api.nvim_buf_get_lines(0, 0, -1, true), good)

--- Puts the cursor on a text, or behind it.
local function go(text, behind)
  local row = vim.fn.search("\\V" .. text, "cw")
  assert(row > 0, text)
  local start = vim.api.nvim_get_current_line():find(text, 1, true) - 1
  vim.api.nvim_win_set_cursor(0, { row, start + (behind and #text or 0) })
end
local function ask(method, more)
  local params = vim.lsp.util.make_position_params(0, client.offset_encoding)
  local answers = assert(vim.lsp.buf_request_sync(0, method, vim.tbl_extend("force", params, more or {}), 10000))
  local answer = assert(answers[client.id], method)
  assert(not answer.err, vim.inspect(answer.err))
  return answer.result
end

-- What people see of a hover is a window.
go("train(")
vim.lsp.buf.hover()
local function windows()
  return vim.tbl_filter(function(w) return vim.api.nvim_win_get_config(w).relative ~= "" end, vim.api.nvim_list_wins())
end
wait("the hover's window", function() return #windows() == 1 end)
local hover = table.concat(vim.api.nvim_buf_get_lines(vim.api.nvim_win_get_buf(windows()[1]), 0, -1, true), "\n")
assert(hover:find("A model learned from data.", 1, true) and hover:find("train(", 1, true), hover)
vim.api.nvim_win_close(windows()[1], true)
print("ok: hover")

-- Definition.
go("model, ke")
vim.lsp.buf.definition()
wait("the definition", function() return vim.api.nvim_win_get_cursor(0)[1] == 9 end)
print("ok: definition")

-- Rename, of an axis and wherever it is named.
go("ke =")
vim.lsp.buf.rename("doubt")
wait("the rename", function() return vim.api.nvim_get_current_line():find("axis doubt =", 1, true) end)
local renamed = table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, true), "\n")
assert(renamed:find("ke: doubt,", 1, true) and renamed:find('cost[doubt: "WCM"]', 1, true), renamed)
print("ok: rename")
vim.api.nvim_buf_set_lines(0, 0, -1, true, good)

-- Completion, as a person types.
local function labels()
  local answer = ask("textDocument/completion")
  return vim.tbl_map(function(i) return i.label end, answer.items or answer)
end
vim.api.nvim_buf_set_lines(0, 0, -1, true, wrong("chosen = argmax(model", "chosen = arg(model"))
go("chosen = arg", true)
assert(vim.tbl_contains(labels(), "argmax"), vim.inspect(labels()))
print("ok: completion of operations")
vim.api.nvim_buf_set_lines(0, 0, -1, true, wrong('cost[ke: "WCM"]', 'cost[ke: "'))
go('cost[ke: "', true)
local found = vim.tbl_map(function(l) return (l:gsub('"', "")) end, labels())
table.sort(found)
equal("completion of labels", found, { "BCM", "WCM" })

-- Formatting.
vim.api.nvim_buf_set_lines(0, 0, -1, true, wrong("    axis seed = 0..5", "  axis   seed=0..5"))
vim.lsp.buf.format({ timeout_ms = 10000 })
equal("formatting", vim.api.nvim_buf_get_lines(0, 0, -1, true), good)

-- Code lenses have commands that the third snippet gives them.
local ran = {}
vim.fn.termopen = function(command) table.insert(ran, command) end
for _, lens in ipairs(ask("textDocument/codeLens")) do
  local command = lens.command or client:request_sync("codeLens/resolve", lens, 10000, 0).result.command
  client:exec_cmd(command)
end
equal("lens of run", ran[1], { "ivx", "exec", path })
assert(vim.tbl_contains(vim.tbl_map(function(c) return c[2] end, ran), "why"), vim.inspect(ran))
print("ok: lens of why")

vim.lsp.stop_client(client.id)
wait("the end", function() return #vim.lsp.get_clients() == 0 end)
print("ok: Neovim by snippet " .. snippet)
