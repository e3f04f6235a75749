// SPDX-License-Identifier: Apache-2.0
// Starts `dpde lsp`.
const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

exports.activate = () => {
  const command = workspace.getConfiguration("dpde").get("path");
  client = new LanguageClient("dpde", "dpde", { command, args: ["lsp"] }, { documentSelector: [{ language: "dpde" }] });
  return client.start();
};

exports.deactivate = () => client && client.stop();
