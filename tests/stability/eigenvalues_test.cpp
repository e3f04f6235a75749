// SPDX-License-Identifier: Apache-2.0
// Eigenvalues known in closed form: of circulants, companion matrices, and similar matrices.
#include "stability/eigenvalues/eigenvalues.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace dpde::stability {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;

/// The largest distance between an expected value and the nearest computed one; each computed value is used once.
double distance(std::vector<Complex> expected, const Eigen::VectorXcd& found) {
  EXPECT_EQ(static_cast<Index>(expected.size()), found.size());
  double largest = 0;
  for (const Complex value : found) {
    const auto nearest = std::ranges::min_element(expected, {}, [&](Complex e) { return std::abs(e - value); });
    largest = std::max(largest, std::abs(*nearest - value));
    expected.erase(nearest);
  }
  return largest;
}

TEST(Eigenvalues, OfCirculantsAreTheirFourierSums) {
  for (const int size : {1, 2, 3, 4, 5, 17, 60}) {
    const std::vector<Complex> row{Complex(1, 0.25), -0.5, Complex(0, 2)};
    Eigen::MatrixXcd a = Eigen::MatrixXcd::Zero(size, size);
    std::vector<Complex> expected(static_cast<std::size_t>(size));
    for (int k = 0; k < std::min(size, 3); ++k) {
      const auto entry = row[static_cast<std::size_t>(k)];
      for (int i = 0; i < size; ++i) {
        a(i, (i + k) % size) += entry;
        expected[static_cast<std::size_t>(i)] += entry * std::polar(1.0, 2 * std::numbers::pi * i * k / size);
      }
    }
    EXPECT_LT(distance(expected, eigenvalues(a)), 1e-12) << size;
  }
}

TEST(Eigenvalues, OfCompanionsAreTheRoots) {
  const std::vector<Complex> roots{1, -2, Complex(0.5, 1.5), Complex(0.5, -1.5), 3, Complex(0, -0.25)};
  std::vector<Complex> polynomial{1};  // from the highest power on
  for (const Complex root : roots) {
    polynomial.push_back(0);
    for (std::size_t i = polynomial.size(); i-- > 1;) polynomial[i] -= root * polynomial[i - 1];
  }
  const auto size = static_cast<Index>(roots.size());
  Eigen::MatrixXcd a = Eigen::MatrixXcd::Zero(size, size);
  for (Index i = 0; i < size; ++i) a(0, i) = -polynomial[static_cast<std::size_t>(i) + 1];
  for (Index i = 1; i < size; ++i) a(i, i - 1) = 1;
  EXPECT_LT(distance(roots, eigenvalues(a)), 1e-11);
}

/// a = S D S^-1 with S of unit lower triangle, in other units for each row (10^-8 .. 10^8).
std::pair<Eigen::MatrixXcd, Eigen::MatrixXcd> similar_to(const std::vector<Complex>& values, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto size = static_cast<Index>(values.size());
  Eigen::MatrixXcd s = Eigen::MatrixXcd::Identity(size, size), a = s;
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < i; ++j) s(i, j) = Complex(number(random), number(random));
  }
  for (Index i = 0; i < size; ++i) {  // a S = S D, column by column of a from the last on
    for (Index j = size; j-- > 0;) {
      a(i, j) = s(i, j) * values[static_cast<std::size_t>(j)];
      for (Index k = j + 1; k < size; ++k) a(i, j) -= a(i, k) * s(k, j);
    }
  }
  for (Index i = 0; i < size; ++i) {
    const double unit = std::exp(std::log(1e8) * number(random));
    a.row(i) *= unit;
    a.col(i) /= unit;
    s.row(i) *= unit;
  }
  return {a, s};
}

/// x^3 - 2x - e: the largest root is sqrt(2) + e/4 up to e^2.
TEST(Eigenvalues, SmallEntriesBelowTheSubdiagonalCount) {
  const double e = 7e-9;
  Eigen::MatrixXd a(5, 5);  // two more rows, as small matrices go another way
  a << 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, e, 1, 0, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0, 0.25;
  EXPECT_NEAR(eigenvalues(a).real().maxCoeff(), std::sqrt(2.0) + e / 4, 1e-13);
}

TEST(Eigenvalues, OfSimilarMatricesAreTheSame) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    for (const std::size_t size : {3u, 4u, 6u, 9u}) {
      std::vector<Complex> values;
      for (std::size_t i = 0; i < size; ++i) values.emplace_back(static_cast<double>(i) - 1, i % 2 == 0 ? 0.5 : -0.5);
      EXPECT_LT(distance(values, eigenvalues(similar_to(values, seed).first)), 1e-9) << size;
    }
  }
}

/// The second difference between walls with value 0, and a rotation as a separate block.
TEST(Eigenvalues, OfRealMatricesArePairsOrReal) {
  for (const int size : {1, 2, 3, 8, 40}) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(size + 2, size + 2);
    std::vector<Complex> expected{Complex(0.5, 2), Complex(0.5, -2)};
    for (int i = 0; i < size; ++i) {
      a(i, i) = -2;
      if (i > 0) a(i, i - 1) = a(i - 1, i) = 1;
      expected.emplace_back(-2 + 2 * std::cos(std::numbers::pi * (i + 1) / (size + 1)));
    }
    a(size, size) = a(size + 1, size + 1) = 0.5;
    a(size, size + 1) = 4;
    a(size + 1, size) = -1;
    for (int i = 0; i < size; ++i) a(i, size) = 1 + i;  // which changes no eigenvalue
    EXPECT_LT(distance(expected, eigenvalues(a)), 1e-11) << size;
  }
}

/// With shifts by the last entries a cyclic permutation never converges. Zero matrices, constant matrices and Jordan
/// blocks are the other special cases.
TEST(Eigenvalues, OfMatricesThatShiftsDoNotTurn) {
  for (const int size : {3, 5, 6, 16, 33}) {
    Eigen::MatrixXd cycle = Eigen::MatrixXd::Zero(size, size), block = cycle;
    std::vector<Complex> roots, twos, ones_and_zeros;
    for (int i = 0; i < size; ++i) {
      cycle((i + 1) % size, i) = 1;
      block(i, i) = 2;
      if (i > 0) block(i - 1, i) = 1;
      roots.push_back(std::polar(1.0, 2 * std::numbers::pi * i / size));
      twos.emplace_back(2);
      ones_and_zeros.emplace_back(i == 0 ? size : 0);
    }
    const Eigen::MatrixXd ones = Eigen::MatrixXd::Ones(size, size);
    EXPECT_LT(distance(roots, eigenvalues(cycle)), 1e-13) << size;
    EXPECT_LT(distance(roots, eigenvalues(Eigen::MatrixXcd(Complex(1, 0) * cycle))), 1e-13) << size;
    std::vector<Complex> turned;
    for (const Complex root : roots) turned.push_back(Complex(0, 2) * root);
    EXPECT_LT(distance(turned, eigenvalues(Eigen::MatrixXcd(Complex(0, 2) * cycle))), 1e-13) << size;
    EXPECT_LT(distance(twos, eigenvalues(block)), 1e-15) << size;
    EXPECT_LT(distance(ones_and_zeros, eigenvalues(ones)), 1e-12) << size;
    EXPECT_LT(distance(std::vector<Complex>(static_cast<std::size_t>(size)), eigenvalues(Eigen::MatrixXd(0 * ones))),
              1e-300)
        << size;
  }
}

/// A short step is nearly the identity: accuracy is relative to its change, not to its size.
TEST(Eigenvalues, OfWhatIsNearlyOneAreOfTheChange) {
  for (const double change : {1e-2, 1e-5, 1e-9}) {
    const int size = 96;
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(size, size);
    for (int i = 0; i < size; ++i) {
      const double speed = change * (1 + 0.5 * std::sin(2 * std::numbers::pi * (i + 0.5) / size));
      a(i, (i + 1) % size) -= speed;
      a(i, (i + size - 1) % size) += speed;
    }
    const Eigen::MatrixXd changed = (a - Eigen::MatrixXd::Identity(size, size)) / change;
    const double trace = (changed * changed).trace();
    for (const Complex turn : {Complex(1), Complex(0, 1)}) {
      const Eigen::VectorXcd values =
          turn == 1.0 ? eigenvalues(a) : eigenvalues(Eigen::MatrixXcd(turn * a.cast<Complex>()));
      const Eigen::ArrayXcd changes = (values.array() / turn - 1) / change;
      EXPECT_LT(std::abs(changes.square().sum() - trace), 1e-3 * std::abs(trace)) << change << turn;
    }
  }
}

/// Multistep methods have nearly nilpotent steps: entries below a diagonal of zeros are as small as rounding.
TEST(Eigenvalues, OfNilpotentMatricesAreRootsOfRounding) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const int size : {6, 24, 60}) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(size, size);
    for (int i = 0; i + size / 3 < size; ++i) a(i + size / 3, i) = 1;
    const Eigen::MatrixXd q =
        Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); }).householderQr().householderQ();
    EXPECT_LT(eigenvalues(a).cwiseAbs().maxCoeff(), 1e-4) << size;
    EXPECT_LT(eigenvalues(Eigen::MatrixXd(q * a * q.transpose())).cwiseAbs().maxCoeff(), 1e-4) << size;
    const Eigen::MatrixXcd turned = Complex(0, 1) * (q * a * q.transpose()).cast<Complex>();
    EXPECT_LT(eigenvalues(turned).cwiseAbs().maxCoeff(), 1e-4) << size;
  }
}

TEST(Eigenvalues, OfWhatIsNotFiniteAreNoNumbers) {
  for (const int size : {5, 12}) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Random(size, size);
    a(1, 2) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(eigenvalues(a).array().isNaN().any());
    EXPECT_TRUE(eigenvalues(Eigen::MatrixXcd(Complex(0, 1) * a)).array().isNaN().any());
    a(1, 2) = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(eigenvalues(a).array().isFinite().all());
  }
}

/// Random matrices of many sizes: the trace of a power is the sum of powers of the eigenvalues.
TEST(Eigenvalues, HaveTheTracesOfPowers) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (int size = 3; size < 40; size += 4) {
    const Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); }) / size,
                          b = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); }) / size;
    const Eigen::MatrixXcd c = a.cast<Complex>() + Complex(0, 1) * b;
    const Eigen::VectorXcd of_a = eigenvalues(a), of_c = eigenvalues(c);
    Eigen::MatrixXcd power_of_a = Eigen::MatrixXcd::Identity(size, size), power_of_c = power_of_a;
    for (int power = 1; power < 5; ++power) {
      power_of_a = (power_of_a * a.cast<Complex>()).eval(), power_of_c = (power_of_c * c).eval();
      EXPECT_LT(std::abs(of_a.array().pow(power).sum() - power_of_a.trace()), 1e-12) << size << " " << power;
      EXPECT_LT(std::abs(of_c.array().pow(power).sum() - power_of_c.trace()), 1e-12) << size << " " << power;
    }
  }
}

/// A leapfrog step of waves on a ring, all of its space, with units that set speeds of states far apart. The mean grows
/// in proportion to time: a double 1 with one vector, which rounding splits by its root.
TEST(Eigenvalues, OfSpacesSplitDoubleOnesByNoMoreThanTheRootOfRounding) {
  constexpr Index cells = 17, size = 2 * cells;
  for (const double step : {1e-3, 5e-4, 2.5e-4, 1.25e-4}) {
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(cells, cells);
    Eigen::MatrixXd lap = -2 * one, whole(size, size);
    for (Index i = 0; i < cells; ++i) lap(i, (i + 1) % cells) += 1, lap((i + 1) % cells, i) += 1;
    lap *= 1e4;
    const Eigen::MatrixXd kept = one + 0.5 * step * step * lap;
    whole << kept, step * one, 0.5 * step * (lap + lap * kept), kept;
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    Eigen::VectorXd image = Eigen::VectorXd::NullaryExpr(size, [&] { return normal(random); });
    for (int k = 0; k < 400; ++k) image = whole * image.normalized();
    Eigen::MatrixXd basis(size, size), space = Eigen::MatrixXd::Zero(size, size);
    for (Index k = 0; k < size; ++k) {
      if (k > 0) space(k, k - 1) = image.norm();
      basis.col(k) = image.normalized();
      image = whole * basis.col(k);
      for (int turn = 0; turn < 2; ++turn) {
        const Eigen::VectorXd shares = basis.leftCols(k + 1).transpose() * image;
        image -= basis.leftCols(k + 1) * shares;
        space.col(k).head(k + 1) += shares;
      }
    }
    for (const Complex value : eigenvalues_of_space(space)) {
      if (std::abs(value - 1.0) < 1e-4) EXPECT_LT(std::abs(value - 1.0), 2e-8) << step;
    }
  }
}

TEST(Eigenvalues, LargestComponentIsThatOfTheEigenvector) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    const std::vector<Complex> values{0.5, Complex(0, 1.25), -1, 0.125, 0};
    const auto [a, s] = similar_to(values, seed);
    Index expected = 0;
    s.col(1).cwiseAbs().maxCoeff(&expected);
    EXPECT_EQ(largest_component(a), expected) << seed;
  }
  EXPECT_EQ(largest_component(Eigen::MatrixXcd::Zero(2, 2)), 0);
}

/// With rounding of 1e-14 the eigenvalues of a triangular Toeplitz matrix of 60 rows move by (1e-14)^(1/60).
TEST(Eigenvalues, AboveOneForSureMayBeMultiple) {
  const auto size = Index{60};
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
  Eigen::MatrixXd nilpotent = Eigen::MatrixXd::Zero(size, size);
  for (Index i = 1; i < size; ++i) nilpotent(i - 1, i) = 1;
  Eigen::MatrixXd groups = identity;
  groups.diagonal().head(7).setConstant(1.1);
  groups.diagonal().tail(30).setConstant(0.9);
  const Eigen::MatrixXd basis = identity + 0.5 * nilpotent;
  const Eigen::MatrixXd similar = basis * groups * basis.inverse();
  struct Row {
    std::string name;
    Eigen::MatrixXd matrix;
    Index count;  // of eigenvalues that are surely above 1
  };
  const std::vector<Row> rows{{"above", 1.001 * identity, size},
                              {"rounding", (1 + 1e-15) * identity, 0},
                              {"groups", groups, 7},
                              {"similar", similar, 7},
                              {"one block", 1.1 * identity + nilpotent, 0},
                              {"small block", 1.1 * identity + 1e-3 * nilpotent, size}};
  for (const Row& row : rows) {
    const SureSpectrum spectrum(row.matrix, SureSpectrum::Of::factors, 1e-14);
    EXPECT_TRUE(row.count == 0 || spectrum.are_beyond(1, row.count)) << row.name;
    EXPECT_FALSE(row.count < size && spectrum.are_beyond(1, row.count + 1)) << row.name;
  }
}

/// Rates of 0.3, 0 and twice -1e-3 beside one of -1e3: a line leaves out what may be 0, and nothing else.
TEST(SureSpectrum, SlowDecayIsToldApartFromNone) {
  Eigen::MatrixXd rates = Eigen::Vector<double, 5>(0.3, 0, -1e-3, -1e-3, -1e3).asDiagonal();
  rates(0, 4) = 7;
  rates(2, 0) = -2;
  const SureSpectrum spectrum(rates, SureSpectrum::Of::rates, 1e-9);
  EXPECT_LT(spectrum.boundary_within(0), 0);
  EXPECT_GT(spectrum.boundary_within(0), -1e-3);
  EXPECT_TRUE(spectrum.are_beyond(-1e-3 / 2, 2));
  EXPECT_FALSE(spectrum.are_beyond(-1e-3 / 2, 3));
}

}  // namespace
}  // namespace dpde::stability
