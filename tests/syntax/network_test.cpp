// SPDX-License-Identifier: Apache-2.0
// Networks and what programs do with them, as written.
#include <gtest/gtest.h>

#include "syntax/parse_helpers.h"

namespace dpde::ast {
namespace {

template <class Block>
Block only_network_block(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const File file = parse(source, sink);
  EXPECT_EQ(problems(source, sink), "");
  return file.declarations.size() == 1 ? std::get<Block>(file.declarations[0].kind) : Block{};
}

TEST(Networks, AsLayers) {
  const std::string text =
      "network corrector(u: vector, nu) -> vector {\n"
      "  padding replicate\n"
      "  initial he, seed 7\n"
      "  conv 32, 5\n"
      "  relu  # the first\n"
      "  repeat 3 {\n"
      "    residual { conv 32, 5; leaky_relu(0.2); conv 32, 5 }\n"
      "    relu\n"
      "  }\n"
      "  skip { mean_pool 2; conv 32, 3; upsample 2 }\n"
      "  scale -0.5\n"
      "  conv out, 5, gain = 0.01, initial = zero\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Network network = only_network_block<Network>(text);
  ASSERT_EQ(network.inputs.size(), 2u);
  EXPECT_TRUE(network.inputs[0].vector);
  EXPECT_FALSE(network.inputs[1].vector);
  ASSERT_EQ(network.outputs.size(), 1u);
  EXPECT_EQ(network.outputs[0].name, "vector");
  EXPECT_FALSE(network.input_channels || network.output_channels);
  ASSERT_EQ(network.items.size(), 8u);
  const auto& start = get<StartItem>(network.items[1].kind);
  EXPECT_EQ(start.method->name, "he");
  EXPECT_EQ(print(*start.seed), "7");
  EXPECT_EQ(get<LayerItem>(network.items[2].kind).arguments.size(), 2u);
  const auto& repeat = get<RepeatItem>(network.items[4].kind);
  ASSERT_EQ(repeat.items.size(), 2u);
  const auto& residual = get<BranchItem>(repeat.items[0].kind);
  EXPECT_EQ(residual.join, BranchItem::Join::add);
  EXPECT_EQ(text.substr(residual.word_range.begin, residual.word_range.end - residual.word_range.begin), "residual");
  EXPECT_EQ(get<LayerItem>(residual.items.at(1).kind).layer.name, "leaky_relu");
  EXPECT_EQ(get<BranchItem>(network.items[5].kind).join, BranchItem::Join::concat);
  EXPECT_EQ(print(get<LayerItem>(network.items[6].kind).arguments.at(0).value), "-0.5");
  const auto& last = get<LayerItem>(network.items[7].kind);
  EXPECT_EQ(std::get<Name>(last.arguments.at(0).value->kind).name, "out");
  EXPECT_EQ(last.arguments.at(2).name, "gain");
  EXPECT_EQ(text.substr(last.arguments[3].name_range.begin, 7), "initial");
}

TEST(Networks, WithSymmetriesAndSharedWeights) {
  const std::string text =
      "network n(u: vector, s) -> vector {\n"
      "  symmetric flips, flip x, rotations, rotations about z, galilean, galilean(u, s)\n"
      "  repeat 2 shared { conv 3, 3; relu }\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Network network = only_network_block<Network>(text);
  const auto& parts = get<SymmetryItem>(network.items.at(0).kind).parts;
  ASSERT_EQ(parts.size(), 6u);
  EXPECT_FALSE(parts[0].axis);
  EXPECT_EQ(parts[1].axis->name, "x");
  EXPECT_FALSE(parts[2].axis);
  EXPECT_EQ(parts[3].word.name, "rotations");
  EXPECT_EQ(parts[3].axis->name, "z");
  EXPECT_TRUE(parts[4].inputs.empty());
  EXPECT_EQ(parts[5].inputs.at(1).name, "s");
  EXPECT_TRUE(get<RepeatItem>(network.items.at(1).kind).shared);
}

TEST(Networks, AsValues) {
  const std::string text =
      "network n(3) -> 2 {\n"
      "  padding x periodic, y zero\n"
      "  real f64\n"
      "  initial seed 12\n"
      "  let v1 = conv(in, 32, 5)\n"
      "  let v2 = add(relu(v1), v1)\n"
      "  out = conv(v2, out, 1)\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Network network = only_network_block<Network>(text);
  EXPECT_EQ(network.input_channels, 3);
  EXPECT_EQ(network.output_channels, 2);
  EXPECT_TRUE(network.inputs.empty() && network.outputs.empty());
  const auto& padding = get<PaddingItem>(network.items[0].kind);
  ASSERT_EQ(padding.axes.size(), 2u);
  EXPECT_EQ(padding.axes[1].name.name, "y");
  EXPECT_EQ(padding.axes[1].padding.name, "zero");
  EXPECT_EQ(get<RealItem>(network.items[1].kind).precision.name, "f64");
  EXPECT_FALSE(get<StartItem>(network.items[2].kind).method.has_value());
  EXPECT_EQ(get<AssignItem>(network.items[5].kind).target.name, "out");
}

TEST(Networks, OnOneLine) {
  EXPECT_EQ(formatted("network k ( a,b : scalar )->da ,db{dense 8;tanh;dense out}"),
            "network k(a, b) -> da, db { dense 8; tanh; dense out }\n");
  EXPECT_EQ(formatted("network k(a) {\n  residual {\n  tanh }\n}"), "network k(a) {\n  residual {\n    tanh\n  }\n}\n");
}

TEST(Networks, InsideOneAnotherUpToALimit) {
  const auto nested = [](int depth) {
    std::string open, close;
    for (int i = 0; i < depth; ++i) {
      open += i % 2 == 0 ? "residual { " : "repeat 2 { ";
      close += "}";
    }
    return "network n(u) { " + open + "relu" + close + " }";
  };
  EXPECT_EQ(problems_of(nested(16)), "");
  EXPECT_EQ(problems_of(nested(17)).substr(0, 11), "1:192 E0376");
  EXPECT_NE(problems_of(nested(5000)), "");
}

TEST(Statements, OfNetworks) {
  const std::string text =
      "program p {\n"
      "  apply corrector(a, u.x) to c, d\n"
      "  tangent corrector(a, u.x) by a_dot, _ to c_dot, d_dot\n"
      "  tangent corrector(a, u.x) by _, _ to c_dot, d_dot weights\n"
      "  adjoint corrector(a, u.x) by c_bar, d_bar to a_bar, _\n"
      "  adjoint corrector(a, u.x) by c_bar, d_bar to _, _ weights\n"
      "  repeat 2 {\n"
      "    apply corrector(a, b) to c, d\n"
      "    swap a, c\n"
      "  }\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Program program = only_network_block<Program>(text);
  const auto& value = get<ApplyItem>(program.items[0].kind);
  EXPECT_EQ(value.mode, ApplyItem::Mode::value);
  EXPECT_EQ(value.network.name, "corrector");
  EXPECT_EQ(value.inputs.at(1).name, "u.x");
  EXPECT_TRUE(value.by.empty());
  EXPECT_EQ(value.to.at(1).name, "d");
  const auto& tangent = get<ApplyItem>(program.items[2].kind);
  EXPECT_EQ(tangent.mode, ApplyItem::Mode::tangent);
  EXPECT_TRUE(tangent.weights);
  EXPECT_EQ(tangent.by.at(0).name, "_");
  const auto& adjoint = get<ApplyItem>(program.items[3].kind);
  EXPECT_EQ(adjoint.mode, ApplyItem::Mode::adjoint);
  EXPECT_FALSE(adjoint.weights);
  EXPECT_EQ(adjoint.by.at(0).name, "c_bar");
  EXPECT_EQ(adjoint.to.at(0).name, "a_bar");
}

}  // namespace
}  // namespace dpde::ast
