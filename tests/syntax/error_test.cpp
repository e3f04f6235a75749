// SPDX-License-Identifier: Apache-2.0
// Items after a mistake are read. Codes, places and words of mistakes are in tests/diagnostics/syntax.
#include <gtest/gtest.h>

#include "syntax/parse_helpers.h"

namespace dpde::ast {
namespace {

TEST(Errors, KeepWhatWasUnderstood) {
  const SourceFile source("t.dpde", "model m {\n  field u\n  oops\n  param nu\n}\nbroken {\n}\nscheme s { a = 1 }\n");
  DiagnosticSink sink;
  const File file = parse(source, sink);
  EXPECT_EQ(sink.all().size(), 2u);
  EXPECT_EQ(print(file), "model m {\n  field u\n  param nu\n}\nscheme s { a = 1 }\n");
}

}  // namespace
}  // namespace dpde::ast
