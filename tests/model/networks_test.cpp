// SPDX-License-Identifier: Apache-2.0
// Network blocks: which layers they become, on which grids, with which padding; and what cannot be a network.
#include <gtest/gtest.h>

#include "model/from_ast/network_from_ast.h"
#include "model/model_support.h"
#include "network/print_network.h"

namespace dpde::model {
namespace {

using network::Activation;
using network::Init;
using network::LayerKind;
using network::Network;
using network::Padding;

const Topology periodic = Topology::periodic, bounded = Topology::bounded;

std::optional<double> literal(const ast::Expr& e, const std::string&) {
  if (const auto* unary = std::get_if<ast::Unary>(&e->kind)) return -literal(unary->operand, "").value();
  return std::get<ast::Number>(e->kind).value;
}

/// Of a frame, or as the header counts channels.
struct Made {
  std::optional<Network> network;
  std::string problems;  // 3:5 E0338 message | hint
};
Made make(const std::string& text, std::optional<NetworkFrame> frame = {}) {
  const SourceFile source("n.dpde", text);
  DiagnosticSink sink;
  const ast::File file = ast::parse(source, sink);
  EXPECT_FALSE(sink.has_errors()) << sink.all().front().message;
  const auto& block = std::get<ast::Network>(file.declarations.at(0).kind);
  Made made;
  made.network = frame ? network_from_ast(block, *frame, literal, sink) : network_from_ast(block, sink);
  EXPECT_EQ(made.network.has_value(), !sink.has_errors());
  for (const Diagnostic& d : sink.all()) {
    const LineColumn place = source.locate(d.range.begin);
    made.problems += std::to_string(place.line) + ":" + std::to_string(place.column) + " " + std::string(d.kind->code) +
                     " " + d.message;
    made.problems += (d.hint.empty() ? "" : " | " + d.hint) + "\n";
  }
  return made;
}

Network network_of(const std::string& layers, int inputs, int outputs, std::vector<Topology> axes) {
  const Made made = make("network n(u) {\n" + layers + "\n}", NetworkFrame{inputs, outputs, std::move(axes)});
  EXPECT_EQ(made.problems, "");
  return made.network.value();
}

TEST(Networks, AreLayersInOrder) {
  const Network n = network_of(
      "initial xavier, seed 7\nconv 8, 5, stride = 2, groups = 2, bias = 0; leaky_relu(0.2)\nupsample 2; conv out, 3, "
      "dilation = 4, gain = 0.01, initial = zero\nscale -0.5; fix_sum 1; tanh",
      4, 3, {periodic, bounded});
  ASSERT_EQ(n.layers.size(), 7u);
  EXPECT_EQ(n.inputs, 4);
  EXPECT_EQ(n.outputs, 3);
  EXPECT_EQ(n.seed, 7u);
  EXPECT_EQ(n.real, Precision::f32);
  EXPECT_EQ(n.padding, (std::vector{Padding::periodic, Padding::replicate}));
  network::Layer conv;
  conv.channels = 8;
  conv.extent = 5;
  conv.stride = 2;
  conv.groups = 2;
  conv.bias = false;
  conv.init = Init::xavier;
  EXPECT_EQ(n.layers[0], conv);
  EXPECT_EQ(n.layers[1].kind, LayerKind::activate);
  EXPECT_EQ(n.layers[1].activation, Activation::leaky_relu);
  EXPECT_EQ(n.layers[1].factor, 0.2);
  EXPECT_EQ(n.layers[1].channels, 8);
  EXPECT_EQ(n.layers[1].input, 1);
  EXPECT_EQ(n.layers[2].kind, LayerKind::upsample);
  EXPECT_EQ(n.layers[2].stride, 2);
  EXPECT_EQ(n.layers[3].channels, 3);
  EXPECT_EQ(n.layers[3].dilation, 4);
  EXPECT_EQ(n.layers[3].gain, 0.01);
  EXPECT_EQ(n.layers[3].init, Init::zero);
  EXPECT_EQ(n.layers[4].factor, -0.5);
  EXPECT_EQ(n.layers[5].kind, LayerKind::fix_sum);
  EXPECT_EQ(n.layers[5].factor, 1);
  EXPECT_EQ(n.layers[6].activation, Activation::tanh);
  EXPECT_EQ(network::weight_count(n), 8 * 2 * 25 + 3 * 8 * 9 + 3);
}

// Um et al. 2020 print 260354 parameters with 3 input channels and 261154 with 4 (shared/design/systems.md).
TEST(Networks, HaveAsManyWeightsAsPublished) {
  const std::string layers =
      "conv 32, 5; relu\nrepeat 5 { residual { conv 32, 5; relu; conv 32, 5 }; relu }\nconv out, 5";
  EXPECT_EQ(network::weight_count(network_of(layers, 3, 2, {periodic, periodic})), 260354);
  EXPECT_EQ(network::weight_count(network_of(layers, 4, 2, {periodic, periodic})), 261154);
  // the book's residual network of 3x3: 47330, whose first block changes the channels
  const std::string values =
      "let a = relu(conv(conv(in, 32, 3), 32, 3))\nlet b = add(a, conv(in, 32, 1))\n"
      "let c = add(b, conv(relu(conv(b, 32, 3)), 32, 3))\nlet d = add(c, conv(relu(conv(c, 32, 3)), 32, 3))\nout = "
      "conv(d, out, 1)";
  EXPECT_EQ(network::weight_count(network_of(values, 3, 2, {periodic, periodic})), 47330);
  EXPECT_EQ(network::weight_count(network_of("dense 10; silu; dense in; gelu; dense out", 3, 1, {bounded})),
            40 + 33 + 4);
}

TEST(Networks, JoinInputAndBody) {
  const Network n = network_of(
      "residual { conv in, 3 }\nskip { max_pool 2; skip { mean_pool 2; relu; upsample 2 }; upsample 2 }\nconv out, 1",
      2, 1, {periodic, bounded, bounded});
  const std::string text = network::print(n);
  EXPECT_EQ(text,
            "network n(2) -> 1 {\n"
            "  padding x periodic, y replicate, z replicate\n"
            "  let v1 = conv(in, 2, 3)\n"
            "  let v2 = add(in, v1)\n"
            "  let v3 = max_pool(v2, 2)\n"
            "  let v4 = mean_pool(v3, 2)\n"
            "  let v5 = relu(v4)\n"
            "  let v6 = upsample(v5, 2)\n"
            "  let v7 = concat(v3, v6)\n"
            "  let v8 = upsample(v7, 2)\n"
            "  let v9 = concat(v2, v8)\n"
            "  let v10 = conv(v9, 1, 1)\n"
            "  out = v10\n"
            "}\n");
  EXPECT_EQ(n.layers[6].channels, 4);
  EXPECT_EQ(n.layers[8].channels, 6);
}

TEST(Networks, ReadBackWhatIsPrinted) {
  const std::string text =
      "network corrector(3) -> 2 {\n"
      "  padding x periodic, y zero, z reflect\n"
      "  real f64\n"
      "  initial seed 9007199254740991\n"
      "  let v1 = conv(in, 6, 5, stride = 2, dilation = 3, groups = 3, bias = 0, gain = 0.1, initial = xavier)\n"
      "  let v2 = leaky_relu(v1, 0.25)\n"
      "  let v3 = gelu(v2)\n"
      "  let v4 = sigmoid(v3)\n"
      "  let v5 = softplus(v4)\n"
      "  let v6 = silu(v5)\n"
      "  let v7 = mean_pool(v6, 3)\n"
      "  let v8 = max_pool(v7, 2)\n"
      "  let v9 = upsample(v8, 12)\n"
      "  let v10 = concat(in, v9)\n"
      "  let v11 = conv(v10, 2, 1, initial = zero)\n"
      "  let v12 = tanh(v11)\n"
      "  let v13 = add(v11, v12)\n"
      "  let v14 = scale(v13, -0.01)\n"
      "  let v15 = fix_sum(v14, 1.5)\n"
      "  let v16 = reorient(v15, x = -y, y = x, channels = (-2, 1))\n"
      "  let v17 = reorient(v16, z = -z)\n"
      "  let v18 = conv(v17, 2, 1, initial = xavier)\n"
      "  let v19 = conv(v18, 2, 1, weights = v18)\n"
      "  out = v19\n"
      "}\n";
  const Made made = make(text);
  EXPECT_EQ(made.problems, "");
  ASSERT_TRUE(made.network);
  EXPECT_EQ(network::print(*made.network), text);
  EXPECT_EQ(made.network->real, Precision::f64);
  EXPECT_EQ(make(network::print(*made.network)).network, made.network);
}

TEST(Networks, RepeatWithSharedWeights) {
  const Network n = network_of(
      "conv 4, 3\nrepeat 3 shared { conv 4, 3, gain = 0.5; relu; repeat 2 shared { conv 4, 1, bias = 0 } }\nconv out, "
      "1",
      2, 1, {periodic, bounded});
  ASSERT_EQ(n.layers.size(), 14u);
  const auto shared = [&](std::size_t layer) { return n.layers[layer].weights_of; };
  EXPECT_EQ(std::vector<int>({shared(1), shared(3), shared(4), shared(5), shared(7), shared(8), shared(9), shared(11),
                              shared(12), shared(13)}),
            std::vector<int>({0, 0, 4, 2, 4, 4, 2, 4, 4, 0}));
  EXPECT_EQ(network::weight_count(n), 2 * 4 * 9 + 4 + 4 * 4 * 9 + 4 + 4 * 4 + 4 + 1);
  EXPECT_EQ(network::weights_begin(n, 9), network::weights_begin(n, 1));
  EXPECT_EQ(network::bias_begin(n, 9), network::bias_begin(n, 1));
  EXPECT_EQ(network::bias_begin(n, 12), -1);
  EXPECT_EQ(make(network::print(n)).problems, "");
  EXPECT_EQ(make(network::print(n)).network, n);
}

TEST(Networks, HavePaddingOfTheirScene) {
  const auto padding = [](const std::string& line, std::vector<Topology> axes) {
    return network_of(line + "\nconv out, 3", 1, 1, std::move(axes)).padding;
  };
  EXPECT_EQ(padding("", {bounded, periodic}), (std::vector{Padding::replicate, Padding::periodic}));
  EXPECT_EQ(padding("padding reflect", {bounded, periodic}), (std::vector{Padding::reflect, Padding::periodic}));
  EXPECT_EQ(padding("padding y zero", {bounded, bounded}), (std::vector{Padding::replicate, Padding::zero}));
  EXPECT_EQ(padding("padding periodic", {periodic}), (std::vector{Padding::periodic}));
}

TEST(Networks, BelowTheModelCountTheirChannels) {
  EXPECT_EQ(make("network n(u) { relu }").problems,
            "1:9 E0338 network n does not say how many channels it has | below the model inputs and outputs are "
            "numbers: network n(3) -> 2\n");
  EXPECT_EQ(
      make("network n(1) -> 1 { relu }").problems,
      "1:9 E0338 network n does not say its padding along x, then y, then z | write padding x periodic, y zero\n");
  EXPECT_EQ(make("network n(1) -> 1 { padding y zero\n relu }").problems.substr(0, 50),
            "1:9 E0338 network n does not say its padding along");
  EXPECT_EQ(make("network n(1) -> 1 { padding x zero\n scale k }").problems,
            "2:8 E0338 the number of scale is a number here\n");
}

// ---- in scenes -----------------------------------------------------------------------------------------------------
std::string scene_with(const std::string& network) {
  return "model m { vector u; param nu, width; dt(u) = nu*lap(u) }\n"
         "scene s : m { grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, cells 4; width = 8; nu = 1\n"
         "initial u = (0, 0); boundary u = zero_gradient; time 0 .. 1, step 0.1 }\n" +
         network;
}

std::string problem_in(const std::string& network) {
  const Outcome outcome = outcome_of(scene_with(network));
  std::string text;
  for (const Diagnostic& d : outcome.diagnostics) {
    if (d.kind->severity == Severity::error)
      text += std::string(d.kind->code) + " " + d.message + (d.hint.empty() ? "" : " | " + d.hint);
  }
  return text;
}

TEST(Networks, OfScenesThatNothingCallsAreDropped) {
  const Problem problem =
      problem_of(scene_with("network n(u: vector, nu) -> vector { conv 2*width, 3; relu; conv out, 3 }"));
  EXPECT_TRUE(problem.networks.empty());
  EXPECT_EQ(problem.remarks.dropped.back(), "network n: nothing calls it");
}

TEST(Networks, StandWhereTheirMechanismCarries) {
  const auto refusal = [](const std::string& line, const std::string& symmetries = "") {
    const Outcome outcome = outcome_of(
        "model m { field u; coefficient c; control field f; control g; dt(u) = c*u + f + g }\nnetwork n(u) { " +
        symmetries + "; conv out, 3 }\nscene s : m { grid x = 0 .. 1, cells 4; time 0 .. 1, step 0.1\n" + line + "\n" +
        (line.starts_with("initial") ? "" : "initial u = 0\n") +
        (line.starts_with("boundary") ? "" : "boundary u = 0\n") + (line.starts_with("c =") ? "" : "c = 1\n") +
        (line.starts_with("f =") ? "" : "f = 1 every 0.5\n") + (line.starts_with("g =") ? "" : "g = 1 every 0.5\n") +
        "}");
    std::string text;
    for (const Diagnostic& d : outcome.diagnostics) {
      if (d.kind->severity == Severity::error)
        text += std::string(d.kind->code) + " " + d.message + (d.hint.empty() ? "" : " | " + d.hint);
    }
    return text;
  };
  EXPECT_EQ(refusal("initial u = n(x)"), "");
  EXPECT_EQ(refusal("c = 2*n(x)"), "");
  EXPECT_EQ(refusal("observe a = mean(n(u))"), "");
}

/// They would be half a cell off.
TEST(Networks, OfFormulasAreWhereverThatIsWanted) {
  const auto problem = [](const std::string& on) {
    const Outcome outcome = outcome_of(
        "model m { field u on " + on + "; coefficient c on " + on +
        "; dt(u) = c*u }\nnetwork n(u) { conv out, 3 }\n"
        "scene s : m { grid x = 0 .. 1, cells 4, periodic; time 0 .. 1, step 0.1; initial u = 2 + n(x); c = n(x) }");
    std::string text;
    for (const Diagnostic& d : outcome.diagnostics) {
      if (d.kind->severity == Severity::error) text += std::string(d.kind->code) + " " + d.message + "\n";
    }
    return text;
  };
  EXPECT_EQ(problem("centres"), "");
  EXPECT_EQ(problem("faces.x"), "");
}

TEST(Networks, ComputeInThePrecisionOfTheScheme) {
  EXPECT_EQ(problem_of(scene_with("scheme c { networks = f64 }")).scheme.networks, Precision::f64);
  EXPECT_EQ(problem_of(scene_with("scheme c { networks = f32 }")).scheme.networks, Precision::f32);
  EXPECT_EQ(problem_in("scheme c { networks = f16 }"), "E0502 networks cannot be f16 | choose one of: f32, f64");
}

/// On one axis too, where other numbers are vectors of one component.
TEST(Networks, OfOneOutputHaveNoComponents) {
  for (const std::string grid : {"grid x = 0 .. 1, cells 4, periodic",
                                 "grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, cells 4, periodic"}) {
    const auto told = [&](const std::string& result, const std::string& term) {
      const Outcome outcome =
          outcome_of("model m { field u; dt(u) = 0 }\nnetwork n(u) " + result + " { conv out, 3 }\nscene s : m { " +
                     grid + "; time 0 .. 1, step 0.1; initial u = 0; after step: u += " + term + " }");
      return outcome.diagnostics.empty() ? "" : outcome.code_and_hint();
    };
    EXPECT_EQ(told("-> scalar", "n(u)"), "");
    EXPECT_EQ(told("-> vector", "n(u).x"), "");
    EXPECT_EQ(told("-> x", "n(u).x"), "");
  }
}

TEST(Components, OfCallsAndParentheses) {
  const auto refusal = [](const std::string& rhs) { return outcome_of(text_with(rhs, 2)).code_and_hint(); };
  EXPECT_EQ(print(*problem_of(text_with("grad(k*u).y + (u, 2*u).x", 2)).states[0].rhs),
            print(*problem_of(text_with("dy(k*u) + u", 2)).states[0].rhs));
  EXPECT_EQ(print(*problem_of(text_with("grad(k*u).x", 1)).states[0].rhs),
            print(*problem_of(text_with("dx(k*u)", 1)).states[0].rhs));
  EXPECT_EQ(refusal("grad(u).q"), "E0402 components are called x, y and z");
  EXPECT_EQ(refusal("grad(u).z").substr(0, 5), "E0321");
  EXPECT_EQ(refusal("lap(u).x").substr(0, 5), "E0328");
}

}  // namespace
}  // namespace dpde::model
