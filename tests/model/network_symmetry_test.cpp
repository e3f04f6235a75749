// SPDX-License-Identifier: Apache-2.0
// Symmetric networks: what they make of an image of their inputs is the image of what they make.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model/model_support.h"
#include "network/evaluate.h"
#include "network/print_network.h"
#include "network/symmetrise.h"

namespace dpde::model {
namespace {

using network::Network;
using network::Tensor;

/// A signed permutation of axes as what geometry knows: column `axis` goes to row |image[axis]| - 1, with its sign.
using Matrix = std::array<std::array<int, 3>, 3>;

/// Those of `rank` axes, turns and mirror images alike.
std::vector<Matrix> matrices(int rank) {
  std::vector<Matrix> result;
  std::array<int, 3> places{0, 1, 2};
  do {
    if (std::any_of(places.begin() + rank, places.end(),
                    [&](const int& place) { return place != static_cast<int>(&place - places.data()); }))
      continue;
    for (int signs = 0; signs < 1 << rank; ++signs) {
      Matrix m{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        m[static_cast<std::size_t>(places[axis])][axis] = (signs >> axis & 1) != 0 ? -1 : 1;
      result.push_back(m);
    }
  } while (std::ranges::next_permutation(places).found);
  return result;
}

int determinant(const Matrix& m) {
  int sum = 0;
  for (std::size_t a = 0; a < 3; ++a)
    sum += m[0][a] * (m[1][(a + 1) % 3] * m[2][(a + 2) % 3] - m[1][(a + 2) % 3] * m[2][(a + 1) % 3]);
  return sum;
}
bool is_diagonal(const Matrix& m) { return m[0][0] != 0 && m[1][1] != 0 && m[2][2] != 0; }

/// M v(M^-1 x) of a vector, s(M^-1 x) of a number, x counted from the middle of the grid. `vectors`: for each field
/// whether it is one.
Tensor image(const Matrix& m, const Tensor& of, const std::vector<bool>& vectors, int rank) {
  Tensor result = of;
  const auto index = [&](int channel, const std::array<int, 3>& p) {
    return static_cast<std::size_t>(((channel * of.cells[2] + p[2]) * of.cells[1] + p[1]) * of.cells[0] + p[0]);
  };
  for (int z = 0; z < of.cells[2]; ++z) {
    for (int y = 0; y < of.cells[1]; ++y) {
      for (int x = 0; x < of.cells[0]; ++x) {
        const std::array<int, 3> p{x, y, z};
        std::array<int, 3> q{};
        for (std::size_t a = 0; a < 3; ++a) {
          int twice = 0;  // the inverse is the transpose; in half cells from the middle
          for (std::size_t b = 0; b < 3; ++b) twice += m[b][a] * (2 * p[b] - (of.cells[b] - 1));
          q[a] = (twice + of.cells[a] - 1) / 2;
        }
        int channel = 0;
        for (const bool vector : vectors) {
          for (int a = 0; a < (vector ? rank : 1); ++a) {
            double value = vector ? 0 : of.values[index(channel, q)];
            for (int b = 0; vector && b < rank; ++b) {
              value += m[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] * of.values[index(channel + b, q)];
            }
            result.values[index(channel + a, p)] = value;
          }
          channel += vector ? rank : 1;
        }
      }
    }
  }
  return result;
}

std::vector<double> random_values(std::size_t count, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values(count);
  for (double& value : values) value = normal(engine);
  return values;
}

double distance(const Tensor& a, const Tensor& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) most = std::max(most, std::abs(a.values[i] - b.values[i]));
  return most;
}

struct SymmetryCase {
  int rank, cells;
  std::string block;  // below the signature (u: vector, s, v: vector) -> vector
};

Network network_of(const SymmetryCase& c, const std::string& symmetries) {
  std::string text = "model m { vector u, v; field s; dt(u) = n(u, s, v); dt(v) = 0*v; dt(s) = 0*s }\nscene r : m {\n";
  const char* sides[] = {", periodic", "", ", periodic"};
  for (int axis = 0; axis < c.rank; ++axis)
    text += "grid " + std::string(1, "xyz"[axis]) + " = 0 .. 1, cells " + std::to_string(c.cells) +
            (c.rank == 1 ? sides[1] : sides[0]) + "\n";
  text += "initial u = 0; initial v = 0; initial s = 0\n";
  if (c.rank == 1) text += "boundary u = 0; boundary v = 0; boundary s = 0\n";
  text += "time 0 .. 1, step 0.1 }\nnetwork n(u: vector, s, v: vector) -> vector {\n" +
          (symmetries.empty() ? "" : "symmetric " + symmetries) + "\n" + c.block + "\n}";
  return problem_of(text).networks.at(0);
}

const std::string plain = "conv 5, 3; tanh; conv out, 3, dilation = 2";
const std::string pooled =
    "skip { conv 3, 3, stride = 2; gelu; residual { max_pool 2; upsample 2 }; upsample 2 }; conv 6, 3; repeat 2 shared "
    "{ conv 6, 3, groups = 2; silu }; conv out, 1";
const std::string pointwise = "dense 7; tanh; dense out";

/// The images by which the network commutes, and no others.
template <class Member>
void expect_equivariance(const SymmetryCase& c, const std::string& symmetries, const Member& member) {
  const Network network = network_of(c, symmetries);
  EXPECT_EQ(network::weight_count(network), network::weight_count(network_of(c, "")));
  const std::vector<bool> vectors{true, false, true};
  Tensor in{network.inputs, {1, 1, 1}, {}};
  for (int axis = 0; axis < c.rank; ++axis) in.cells[static_cast<std::size_t>(axis)] = c.cells;
  const auto cells = static_cast<std::size_t>(in.cells[0] * in.cells[1] * in.cells[2]);
  in.values = random_values(static_cast<std::size_t>(network.inputs) * cells, 1);
  const std::vector<double> weights = random_values(static_cast<std::size_t>(network::weight_count(network)), 2);
  const Tensor out = value(network, in, weights);
  double size = 1;
  for (const double v : out.values) size = std::max(size, std::abs(v));
  int members = 0;
  for (const Matrix& m : matrices(c.rank)) {
    const double off = distance(value(network, image(m, in, vectors, c.rank), weights), image(m, out, {true}, c.rank));
    if (member(m)) {
      EXPECT_LE(off, 1e-13 * size) << symmetries << " of " << c.block;
      ++members;
    } else {
      EXPECT_GT(off, 1e-3) << symmetries << " of " << c.block;
    }
  }
  EXPECT_GT(members, 0);
  // the reference's derivatives of an image are the images of its derivatives: weights enter all copies
  std::vector<double> bars(weights.size(), 0.0), rates = random_values(weights.size(), 4);
  Tensor in_rates = in, seed = out;
  in_rates.values = random_values(in.values.size(), 5);
  seed.values = random_values(out.values.size(), 6);
  const Tensor rate = tangent(network, in, in_rates, {weights, rates}),
               in_bar = adjoint(network, in, seed, weights, bars);
  double left = 0, right = 0;
  for (std::size_t i = 0; i < rate.values.size(); ++i) left += rate.values[i] * seed.values[i];
  for (std::size_t i = 0; i < in_bar.values.size(); ++i) right += in_bar.values[i] * in_rates.values[i];
  for (std::size_t i = 0; i < bars.size(); ++i) right += bars[i] * rates[i];
  EXPECT_NEAR(left, right, 1e-11 * (std::abs(left) + size));
}

TEST(NetworkSymmetry, ImagesOfInputsGiveImagesOfOutputs) {
  for (const std::string& block : {plain, pooled, pointwise}) {
    const bool small = &block == &pooled;
    expect_equivariance({1, 7, block}, "flips", [](const Matrix&) { return true; });
    expect_equivariance({1, 1, block}, "flip x", [](const Matrix&) { return true; });
    expect_equivariance({2, 5, block}, "flips, rotations", [](const Matrix&) { return true; });
    expect_equivariance({2, 5, block}, "rotations", [](const Matrix& m) { return determinant(m) > 0; });
    expect_equivariance({2, 4, block}, "flips", is_diagonal);
    expect_equivariance({2, 3, block}, "flip y", [](const Matrix& m) { return is_diagonal(m) && m[0][0] > 0; });
    if (small) continue;
    expect_equivariance({3, 3, block}, "rotations", [](const Matrix& m) { return determinant(m) > 0; });
    expect_equivariance({3, 3, block}, "rotations about z, flip z",
                        [](const Matrix& m) { return m[2][2] != 0 && determinant(m) * m[2][2] > 0; });
  }
  expect_equivariance({3, 2, pointwise}, "flips, rotations", [](const Matrix&) { return true; });
}

TEST(NetworkSymmetry, HasACopyForEachImage) {
  const auto copies = [](int rank, const std::string& symmetries, const std::string& block) {
    const Network network = network_of({rank, 4, block}, symmetries);
    return std::ranges::count_if(network.layers,
                                 [](const network::Layer& layer) { return layer.kind == network::LayerKind::conv; });
  };
  EXPECT_EQ(copies(2, "flip x", "conv out, 3"), 2);
  EXPECT_EQ(copies(2, "flips, rotations", "conv out, 3"), 8);
  EXPECT_EQ(copies(3, "rotations about x", "conv out, 3"), 4);
  EXPECT_EQ(copies(3, "flips, rotations", "conv out, 3"), 48);
  EXPECT_EQ(copies(1, "flips", "conv out, 3"), 2);
}

TEST(NetworkSymmetry, TurnsNeedTwoAxes) {
  const auto told = [](const std::string& symmetries, const std::string& grid) {
    const Outcome outcome =
        outcome_of("model m { field u; dt(u) = n(u) }\nnetwork n(u) { symmetric " + symmetries +
                   "\n conv out, 3 }\nscene s : m { " + grid + "; time 0 .. 1, step 0.1; initial u = 0 }");
    return outcome.diagnostics.empty() ? "" : outcome.code_and_hint();
  };
  const std::string line = "grid x = 0 .. 1, cells 4, periodic", plane = line + "; grid y = 0 .. 1, cells 4, periodic";
  EXPECT_EQ(told("flips", line), "");
  EXPECT_EQ(told("rotations", plane), "");
}

/// Numbers in a cell know no direction: nothing is to be done.
TEST(NetworkSymmetry, OfNumbersInACellIsThere) {
  const Network network = problem_of(
                              "model m { field u; dt(u) = n(u, 1) }\nnetwork n(u, v) { symmetric flips, rotations\n "
                              "dense 3; tanh; dense out }\n"
                              "scene s : m { grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, cells 4, periodic; "
                              "initial u = 0; time 0 .. 1, step 0.1 }")
                              .networks.at(0);
  EXPECT_EQ(network.layers.size(), 3u);
}

TEST(NetworkSymmetry, GalileanInputsCountFromTheirMean) {
  const auto equation = [](const std::string& symmetries) {
    return print(*problem_of("model m { vector u; field s; param k; dt(u) = n(u, s, k); dt(s) = 0*s }\nnetwork n(u: "
                             "vector, s, k) -> vector { symmetric " +
                             symmetries +
                             "\n conv out, 3 }\nscene r : m { grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, "
                             "cells 4, periodic; k = 2; initial u = 0; initial s = 0; time 0 .. 1, step 0.1 }")
                      .states[0]
                      .rhs);
  };
  EXPECT_EQ(equation("galilean"), "n(u.x - mean(u.x), u.y - mean(u.y), s, k).x");
  EXPECT_EQ(equation("galilean(s), flips"), "n(u.x, u.y, s - mean(s), k).x");
  EXPECT_EQ(equation("galilean(u, k)"), "n(u.x - mean(u.x), u.y - mean(u.y), s, 0).x");
}

std::string problem_in(const std::string& symmetries, const std::string& grids, const std::string& more = "") {
  const Outcome outcome =
      outcome_of("model m { field u; dt(u) = n(u) }\nnetwork n(u) { symmetric " + symmetries + "\n" + more +
                 " conv out, 3 }\nscene s : m { " + grids + "; initial u = 0; time 0 .. 1, step 0.1; boundary u = 0 }");
  std::string text;
  for (const Diagnostic& d : outcome.diagnostics) {
    if (d.kind->severity == Severity::error)
      text += std::string(d.kind->code) + " " + d.message + (d.hint.empty() ? "" : " | " + d.hint);
  }
  return text;
}

TEST(NetworkSymmetry, IsNoMatterOfScenesThatDoNotCallTheNetwork) {
  const Outcome outcome = outcome_of(
      "model m { field u; dt(u) = lap(u) }\nnetwork n(u) { symmetric rotations, flip z\n conv out, 3 }\n"
      "scene s : m { grid x = 0 .. 1, cells 5; grid y = 0 .. 1, cells 4; initial u = 0; time 0 .. 1, step 0.1; "
      "boundary u = 0 }");
  EXPECT_TRUE(outcome.diagnostics.empty());
}

TEST(NetworkSymmetry, IsAcceptedOnGridsThatHaveIt) {
  const std::string x = "grid x = 0 .. 1, cells 4", y = "; grid y = 0 .. 1, cells ";
  EXPECT_EQ(problem_in("flips, rotations", x + y + "4"), "");
  EXPECT_EQ(problem_in("rotations about z", x + y + "4; grid z = 0 .. 1, cells 3"), "");
  EXPECT_EQ(problem_in("flips, rotations", x + y + "4", "repeat 50 { conv 2, 3; relu }\n"), "");
  EXPECT_EQ(problem_in("flips", x, "reorient x = -x\n"), "");
}

}  // namespace
}  // namespace dpde::model
