" SPDX-License-Identifier: Apache-2.0
" gq formats by dpde; in Neovim the language server starts where the command is on the PATH.
setlocal commentstring=#\ %s comments=:# shiftwidth=2 expandtab
setlocal formatprg=dpde\ fmt\ -
if has('nvim') && executable('dpde')
  lua vim.lsp.start({ name = 'dpde', cmd = { 'dpde', 'lsp' }, root_dir = vim.fn.getcwd() })
endif
