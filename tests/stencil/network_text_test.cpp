// SPDX-License-Identifier: Apache-2.0
// Programs that apply networks, as text: what is printed reads back, and what does not fit is said at its place.
#include <gtest/gtest.h>

#include "source/source_file.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"

namespace dpde::stencil {
namespace {

struct Read {
  Module module;
  std::string problems;
};
Read read(const std::string& text) {
  const SourceFile source("p.dpde", text);
  DiagnosticSink sink;
  Read result{from_ast(ast::parse(source, sink), sink), ""};
  for (const Diagnostic& d : sink.all()) {
    result.problems +=
        std::to_string(source.locate(d.range.begin).line) + " " + std::string(d.kind->code) + " " + d.message;
    result.problems += (d.hint.empty() ? "" : " | " + d.hint) + "\n";
  }
  return result;
}

const std::string network =
    "network n(2) -> 1 {\n"
    "  padding x periodic, y zero\n"
    "  let v1 = conv(in, 1, 3)\n"
    "  out = v1\n"
    "}\n";

TEST(NetworkText, ReadsBack) {
  const std::string text = network +
                           "\nprogram step {\n"
                           "  axes x periodic, y bounded\n"
                           "  apply n(a, u.x) to c\n"
                           "  tangent n(a, u.x) by _, u.x_dot to c_dot weights\n"
                           "  adjoint n(a, u.x) by c_bar to a_bar, _\n"
                           "  keep c, c_dot, a_bar\n"
                           "}\n";
  const Read first = read(text);
  EXPECT_EQ(first.problems, "");
  ASSERT_EQ(first.module.networks.size(), 1u);
  const std::string printed = print(first.module);
  const Read second = read(printed);
  EXPECT_EQ(second.problems, "");
  EXPECT_EQ(second.module, first.module);
  EXPECT_EQ(print(second.module), printed);
  const auto& tangent = std::get<NetworkCall>(first.module.programs.at(0).body.at(1));
  EXPECT_EQ(tangent.mode, NetworkCall::Mode::tangent);
  EXPECT_EQ(tangent.rates, (std::vector<std::string>{"", "u.x_dot"}));
  EXPECT_TRUE(tangent.weights);
  EXPECT_EQ(std::get<NetworkCall>(first.module.programs.at(0).body.at(2)).results,
            (std::vector<std::string>{"a_bar", ""}));
}

/// Nothing but the network says how many axes there are.
TEST(NetworkText, TellsTheNumberOfAxes) {
  const Read two =
      read(network + "kernel k(c: field, out d: field) { d = 2*c }\nprogram p { apply n(a, b) to c; run k; keep d }\n");
  EXPECT_EQ(two.problems, "");
  EXPECT_EQ(two.module.programs.at(0).axes.size(), 2u);
  EXPECT_EQ(two.module.kernels.at(0).rank, 2);
  const Read other = read(network + "program p { axes x periodic; apply n(a, b) to c; keep c }\n");
  EXPECT_EQ(other.problems, "6 E0368 program p applies n, which has 2 axes\n");
}

TEST(NetworkText, SaysWhatDoesNotFit) {
  const auto problems = [](const std::string& statements) {
    return read(network + "program p { " + statements + "; keep c }\n").problems;
  };
  EXPECT_EQ(problems("apply m(a, b) to c"), "6 E0318 there is no network called m\n");
  EXPECT_EQ(problems("apply corrector(a, b) to c"), "6 E0318 there is no network called corrector\n");
  EXPECT_EQ(problems("apply n(a) to c"),
            "6 E0368 program p applies n, which has 2 inputs and 1 outputs, to other numbers of fields\n");
  EXPECT_EQ(problems("apply n(a, b) to b; apply n(a, b) to c"), "6 E0368 program p applies n to b itself\n");
  EXPECT_EQ(read(network + network).problems, "6 E0359 n is already the name of another network\n");
  EXPECT_EQ(read("network n(u: vector) { conv out, 3 }\nprogram p { apply n(a) to c; keep c }\n").problems,
            "2 E0318 there is no network called n | a network for programs counts its channels: network n(3) -> 2\n");
}

TEST(NetworkText, InRepeats) {
  const std::string once = network + "program p { repeat 2 { apply n(a, b) to c; swap a, c } to a_2; swap a, a_2 }\n";
  const Read twice = read(network + "program p { repeat 2 { apply n(a, b) to c; swap a, c } }\n");
  EXPECT_EQ(twice.problems, "");
  EXPECT_EQ(print(twice.module), print(read(once).module));
}

/// A network that a solve has for itself: `r` and `d` are known to nobody else, `k` comes from outside.
TEST(NetworkText, PreconditionsSolves) {
  const auto text = [](const std::string& by, const std::string& call) {
    return "network n(2) -> 1 {\n  padding x periodic\n  let v1 = conv(in, 1, 3)\n  out = v1\n}\n\n"
           "kernel image(p: field halo 1, hx: param, out q: field) {\n"
           "  q = (p[-1] - 2*p + p[+1])/hx^2 - p\n}\n\n"
           "program step {\n  axes x periodic\n  solve q = b for p by " +
           by + " preconditioner " + call +
           " tolerance 1e-06 {\n    fill p x = periodic\n    run image\n  }\n  keep p\n}\n";
  };
  const Read first = read(text("cg", "n(r, k) to d"));
  EXPECT_EQ(first.problems, "");
  const std::string printed = print(first.module);
  EXPECT_NE(printed.find("by cg preconditioner n(r, k) to d tolerance 1e-06 {"), std::string::npos) << printed;
  EXPECT_EQ(read(printed).module, first.module);
  EXPECT_EQ(verify(first.module), std::vector<std::string>{});
  for (const auto& [by, call] : {std::pair{"bicgstab", "n(r, k) to d"},
                                 {"cg", "n(r) to d"},
                                 {"cg", "m(r, k) to d"},
                                 {"cg", "n(r, r) to d"},
                                 {"cg", "n(b, k) to d"},
                                 {"cg", "n(r, k) to p"},
                                 {"cg", "n(r, k) to k"},
                                 {"cg", "n(r, k) to z"}})
    EXPECT_NE(read(text(by, call)).problems, "") << by << " " << call;
}

}  // namespace
}  // namespace dpde::stencil
