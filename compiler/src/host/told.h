// SPDX-License-Identifier: Apache-2.0
// Diagnostics for hosts: an Error with their texts and source positions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/error.h"
#include "source/diagnostic.h"
#include "source/source_file.h"

namespace dpde::host {

struct Told {
  std::string text;
  std::vector<Message> messages;
  std::optional<ErrorKind> kind;  // of the first error
};

Told told(const SourceFile& source, const DiagnosticSink& sink);

[[noreturn]] void fail(const SourceFile& source, const DiagnosticSink& sink);

}  // namespace dpde::host
