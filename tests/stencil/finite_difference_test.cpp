// SPDX-License-Identifier: Apache-2.0
// Weights against the tables of text books, and their exactness on polynomials.
#include "stencil/space/finite_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "stencil/build.h"
#include "stencil/model_builder.h"
#include "stencil/space/discretise.h"

namespace dpde::stencil {
namespace {

TEST(FiniteDifference, CentralFirstDerivatives) {
  EXPECT_EQ(central_difference(1, 2), (Difference{{{-2, -1}, {2, 1}}, 2, 1}));
  EXPECT_EQ(central_difference(1, 4), (Difference{{{-4, 1}, {-2, -8}, {2, 8}, {4, -1}}, 12, 1}));
  EXPECT_EQ(central_difference(1, 6), (Difference{{{-6, -1}, {-4, 9}, {-2, -45}, {2, 45}, {4, -9}, {6, 1}}, 60, 1}));
}

TEST(FiniteDifference, CentralSecondDerivatives) {
  EXPECT_EQ(central_difference(2, 2), (Difference{{{-2, 1}, {0, -2}, {2, 1}}, 1, 2}));
  EXPECT_EQ(central_difference(2, 4), (Difference{{{-4, -1}, {-2, 16}, {0, -30}, {2, 16}, {4, -1}}, 12, 2}));
  EXPECT_EQ(central_difference(2, 6),
            (Difference{{{-6, 2}, {-4, -27}, {-2, 270}, {0, -490}, {2, 270}, {4, -27}, {6, 2}}, 180, 2}));
}

TEST(FiniteDifference, CentralHigherDerivatives) {
  EXPECT_EQ(central_difference(3, 2), (Difference{{{-4, -1}, {-2, 2}, {2, -2}, {4, 1}}, 2, 3}));
  EXPECT_EQ(central_difference(3, 4), (Difference{{{-6, 1}, {-4, -8}, {-2, 13}, {2, -13}, {4, 8}, {6, -1}}, 8, 3}));
  EXPECT_EQ(central_difference(4, 2), (Difference{{{-4, 1}, {-2, -4}, {0, 6}, {2, -4}, {4, 1}}, 1, 4}));
  EXPECT_EQ(central_difference(6, 2),
            (Difference{{{-6, 1}, {-4, -6}, {-2, 15}, {0, -20}, {2, 15}, {4, -6}, {6, 1}}, 1, 6}));
}

TEST(FiniteDifference, StaggeredDerivativesAndMidpoints) {
  EXPECT_EQ(staggered_difference(2), (Difference{{{-1, -1}, {1, 1}}, 1, 1}));
  EXPECT_EQ(staggered_difference(4), (Difference{{{-3, 1}, {-1, -27}, {1, 27}, {3, -1}}, 24, 1}));
  EXPECT_EQ(staggered_difference(6),
            (Difference{{{-5, -9}, {-3, 125}, {-1, -2250}, {1, 2250}, {3, -125}, {5, 9}}, 1920, 1}));
  EXPECT_EQ(midpoint(2), (Difference{{{-1, 1}, {1, 1}}, 2, 0}));
  EXPECT_EQ(midpoint(4), (Difference{{{-3, -1}, {-1, 9}, {1, 9}, {3, -1}}, 16, 0}));
  EXPECT_EQ(midpoint(6), (Difference{{{-5, 3}, {-3, -25}, {-1, 150}, {1, 150}, {3, -25}, {5, 3}}, 256, 0}));
}

TEST(FiniteDifference, OneSided) {
  EXPECT_EQ(difference(1, {0, 2, 4}), (Difference{{{0, -3}, {2, 4}, {4, -1}}, 2, 1}));
  EXPECT_EQ(difference(2, {0, 2, 4, 6}), (Difference{{{0, 2}, {2, -5}, {4, 4}, {6, -1}}, 1, 2}));
  EXPECT_EQ(difference(0, {0, 2}), (Difference{{{0, 1}}, 1, 0}));
}

/// sum of weight * (place/2)^degree / denominator: degree! when degree = derivative, 0 below the order of the error.
struct Moment {
  long double value = 0;
  long double rounding = 0;
};
Moment moment(const Difference& difference, int degree) {
  Moment m;
  for (const Tap& tap : difference.taps) {
    const long double term = tap.weight * std::pow(tap.place / 2.0L, degree) / difference.denominator;
    m.value += term;
    m.rounding += 1e-17L * std::abs(term);
  }
  return m;
}

TEST(FiniteDifference, ExactOnPolynomialsUpToTheirOrderAndNotBeyond) {
  for (int order = 2; order <= 12; order += 2) {
    for (int derivative = 1; derivative <= 6; ++derivative) {
      const Difference d = central_difference(derivative, order);
      for (int degree = 0; degree < derivative + order; ++degree) {
        const Moment m = moment(d, degree);
        const long double exact = degree == derivative ? std::tgamma(degree + 1.0L) : 0.0L;
        EXPECT_LE(std::abs(m.value - exact), m.rounding) << derivative << " " << order << " " << degree;
      }
      const Moment next = moment(d, derivative + order);
      EXPECT_GT(std::abs(next.value), 100 * next.rounding) << derivative << " " << order;
    }
  }
}

/// Expressions that are there in memory, those that stand in many places once.
void collect_nodes(const Expr& e, std::set<const Node*>& nodes) {
  if (!nodes.insert(&e.node()).second) return;
  for_each_child(e, [&](const Expr& child) { collect_nodes(child, nodes); });
}

std::size_t nodes_of_nested(int depth) {
  model::Expr e = model_builder::field("u");
  for (int i = 0; i < depth; ++i) e = model_builder::lap(e);
  Discretiser at_point(model::Scheme{}, NameSupply{}, 1);
  const Expr result = at_point(e);
  EXPECT_FALSE(at_point.gave_up());
  std::set<const Node*> nodes;
  collect_nodes(result, nodes);
  return nodes.size();
}

/// A difference of depth k reads 2k + 1 places, however many ways lead to each: k^2 values of inner differences, not
/// the 3^k ways. Twice the depth makes four times as many.
TEST(FiniteDifference, NestedOnesAreWorkedOutOnceAPlace) {
  EXPECT_LE(nodes_of_nested(8), 4.5 * static_cast<double>(nodes_of_nested(4)));
}

}  // namespace
}  // namespace dpde::stencil
