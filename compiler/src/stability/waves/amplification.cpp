// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/amplification.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <span>

#include "stability/eigenvalues/eigenvalues.h"

namespace dpde::stability {

namespace {

using std::numbers::pi;

/// Samples along each axis in 1D, 2D, 3D. Multiples of four contain the waves of two and four cells, which limit most
/// schemes.
constexpr std::array<int, 3> waves_along{128, 24, 8};
constexpr std::array<double, 6> long_waves{0.2, 0.1, 0.05, 0.02, 0.01, 0.005};
constexpr int along_diagonals = 32;
constexpr int climbs = 6;
constexpr double finest_climb = 1e-5, coarse_climb = 0.02;  // radians; of the first step
constexpr double worth_a_step = 1e-7;                       // least relative gain of a step
constexpr double small_value = 0.2;                         // of ln |g|: near a limit the largest is 0
constexpr double near_the_best = 0.05;                      // within this, fine steps may still find the maximum
constexpr double rounding = 1e-12;                          // of sums of weights

}  // namespace

Amplification::Readings Amplification::readings_of(const LinearForm& form) {
  std::map<int, ComponentRow> by_component;
  for (const LinearForm::Term& term : form.terms()) {
    const stencil::Offset offset = LinearForm::offset_of(term.key);
    const auto known = std::ranges::find(offsets_, offset);
    const auto number = static_cast<std::size_t>(known - offsets_.begin());
    if (known == offsets_.end()) offsets_.push_back(offset);
    ComponentRow& reading = by_component[LinearForm::component_of(term.key)];
    reading.component = LinearForm::component_of(term.key);
    reading.weights.emplace_back(number, term.coefficient);
  }
  Readings readings;
  for (auto& [component, reading] : by_component) readings.push_back(std::move(reading));
  return readings;
}

namespace {

bool is_same_symbol(const std::vector<NumberMonomial>& a, const std::vector<NumberMonomial>& b) {
  return std::ranges::equal(a, b, [](const NumberMonomial& left, const NumberMonomial& right) {
    return left.coefficient == right.coefficient && left.powers == right.powers && left.vanishes == right.vanishes;
  });
}

bool is_same_multiplier(const WaveMultiplier& a, const WaveMultiplier& b) {
  return a.function == b.function && a.within_two_thirds == b.within_two_thirds && a.means == b.means &&
         is_same_symbol(a.argument, b.argument) && is_same_symbol(a.factor, b.factor);
}

}  // namespace

/// Stages of an exponential scheme share multipliers.
std::size_t Amplification::number_of(const WaveMultiplier& by) {
  const auto known = std::ranges::find_if(multipliers_, [&](const auto& m) { return is_same_multiplier(m, by); });
  const auto number = static_cast<std::size_t>(known - multipliers_.begin());
  if (known == multipliers_.end()) multipliers_.push_back(by);
  return number;
}

std::complex<double> Amplification::ComponentRow::at(const std::vector<std::complex<double>>& phases) const {
  double real = 0, imaginary = 0;
  for (const auto& [place, coefficient] : weights) {
    real += coefficient * phases[place].real();
    imaginary += coefficient * phases[place].imag();
  }
  return {real, imaginary};
}

namespace {

/// Calls `tell` once per offset with its terms, which are contiguous.
void for_each_place(const LinearForm& form,
                    const std::function<void(const stencil::Offset&, std::span<const LinearForm::Term>)>& tell) {
  const std::vector<LinearForm::Term>& terms = form.terms();
  const auto place_of = [](const LinearForm::Term& term) { return term.key - LinearForm::component_of(term.key); };
  for (std::size_t first = 0, end = 0; first < terms.size(); first = end) {
    while (end < terms.size() && place_of(terms[end]) == place_of(terms[first])) ++end;
    tell(LinearForm::offset_of(terms[first].key), std::span(terms).subspan(first, end - first));
  }
}

}  // namespace

void Amplification::note_reach(const LinearForm& form) {
  for_each_place(form, [&](const stencil::Offset& offset, std::span<const LinearForm::Term>) {
    for (std::size_t axis = 0; axis < reach_.size(); ++axis)
      reach_[axis] = std::max(reach_[axis], std::abs(offset[axis]));
  });
}

Amplification::Amplification(const LinearisedStep& response, int rank)
    : size_(static_cast<int>(response.rows.size())), rank_(rank) {
  const std::vector<LinearForm>& rows = response.rows;
  for (const LinearForm& row : rows) note_reach(row);
  for (const WaveSum& sum : response.waves) {
    for (const WaveSum::Term& term : sum.terms) note_reach(term.form);
    note_reach(sum.divisor);
  }
  if (!response.waves.empty()) {
    for (const LinearForm& row : rows) rows_.push_back(readings_of(row));
    for (const WaveSum& sum : response.waves) {
      Wave& wave = waves_.emplace_back(Wave{{}, readings_of(sum.divisor)});
      for (const WaveSum::Term& term : sum.terms) wave.terms.emplace_back(readings_of(term.form), number_of(term.by));
    }
    return;
  }
  Places places;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for_each_place(rows[row], [&](const stencil::Offset& offset, std::span<const LinearForm::Term> terms) {
      std::vector<double>& weights = places[offset];
      weights.resize(rows.size() * rows.size());
      for (const LinearForm::Term& term : terms)
        weights[static_cast<std::size_t>(LinearForm::component_of(term.key)) * rows.size() + row] = term.coefficient;
    });
  }
  std::map<std::pair<int, int>, Line> lines;
  for (const auto& [offset, weights] : places) {
    Line& line = lines[{offset[1], offset[2]}];
    line.y = offset[1], line.z = offset[2];
    line.x.push_back(offset[0]);
    line.weights.insert(line.weights.end(), weights.begin(), weights.end());
  }
  for (auto& [place, line] : lines) lines_.push_back(std::move(line));
  note_symmetries(places);
}

void Amplification::note_symmetries(const Places& places) {
  const auto is_same = [&](const std::function<stencil::Offset(stencil::Offset)>& image_of) {
    return std::ranges::all_of(places, [&](const auto& entry) {
      const auto image = places.find(image_of(entry.first));
      if (image == places.end()) return false;
      return std::ranges::equal(entry.second, image->second, [](double a, double b) {
        return std::abs(a - b) <= 4 * std::numeric_limits<double>::epsilon() * std::abs(a);
      });
    });
  };
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank_); ++axis) {
    is_even_[axis] = is_same([&](stencil::Offset place) {
      place[axis] = -place[axis];
      return place;
    });
    is_as_before_[axis] = axis > 0 && is_even_[axis] && is_even_[axis - 1] && is_same([&](stencil::Offset place) {
                            std::swap(place[axis], place[axis - 1]);
                            return place;
                          });
  }
}

Angles Amplification::representative(Angles angles) const {
  for (std::size_t axis = 0; axis < angles.size(); ++axis) {
    if (is_even_[axis]) angles[axis] = std::abs(std::remainder(angles[axis], 2 * pi));
  }
  for (std::size_t first = 0, end = 1; first < angles.size(); first = end++) {
    while (end < angles.size() && is_as_before_[end]) ++end;
    std::sort(angles.begin() + static_cast<std::ptrdiff_t>(first), angles.begin() + static_cast<std::ptrdiff_t>(end));
  }
  return angles;
}

/// Sines are computed once per distance along an axis, as hundreds of thousands of waves are evaluated.
Amplification::Phases Amplification::phases_of(const Angles& angles) const {
  Phases phases;
  for (std::size_t axis = 0; axis < phases.size(); ++axis) {
    const bool is_there = axis < static_cast<std::size_t>(rank_);
    const auto reach = static_cast<std::size_t>(reach_[axis]);
    phases[axis].assign(2 * reach + 1, 1.0);
    for (std::size_t i = 1; i <= reach && is_there; ++i) {
      phases[axis][reach + i] = std::polar(1.0, angles[axis] * static_cast<double>(i));
      phases[axis][reach - i] = std::conj(phases[axis][reach + i]);
    }
  }
  return phases;
}

std::complex<double> Amplification::phase(const Phases& phases, const stencil::Offset& offset) const {
  std::complex<double> product = 1;
  for (std::size_t axis = 0; axis < phases.size(); ++axis)
    product *= phases[axis][static_cast<std::size_t>(offset[axis] + reach_[axis])];
  return product;
}

/// Weights that sum to 0 give exactly 0: rounding would split a multiple eigenvalue by the root of the rounding error.
Eigen::MatrixXcd Amplification::of_mean() const {
  const Eigen::Index count = static_cast<Eigen::Index>(size_) * size_;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count), size = sum;
  for (const Line& line : lines_) {
    const Eigen::Map<const Eigen::MatrixXd> weights(line.weights.data(), count, std::ssize(line.x));
    sum += weights.rowwise().sum();
    size += weights.cwiseAbs().rowwise().sum();
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    if (std::abs(sum[i]) < rounding * size[i]) sum[i] = 0;
  }
  return Eigen::Map<const Eigen::MatrixXd>(sum.data(), size_, size_).cast<std::complex<double>>();
}

Eigen::MatrixXcd Amplification::at(const Angles& angles) const {
  if (!waves_.empty()) return with_waves(angles);
  if (angles == Angles{}) return of_mean();
  const Phases phases = phases_of(angles);
  Eigen::MatrixXcd sum = Eigen::MatrixXcd::Zero(size_, size_);
  const auto count = static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_);
  std::vector<double> real(count), imaginary(count);
  for (const Line& line : lines_) {
    std::ranges::fill(real, 0.0);
    std::ranges::fill(imaginary, 0.0);
    const double* weight = line.weights.data();
    for (const int x : line.x) {
      const std::complex<double> along = phases[0][static_cast<std::size_t>(x + reach_[0])];
      for (std::size_t i = 0; i < count; ++i, ++weight) {
        real[i] += along.real() * *weight;
        imaginary[i] += along.imag() * *weight;
      }
    }
    const std::complex<double> across = phase(phases, {0, line.y, line.z});
    for (std::size_t i = 0; i < count; ++i)  // products of std::complex check for infinities
      sum.data()[i] += std::complex<double>(across.real() * real[i] - across.imag() * imaginary[i],
                                            across.real() * imaginary[i] + across.imag() * real[i]);
  }
  return sum;
}

/// The amplitudes of each sum of waves by state, followed by those of each row. Real and imaginary parts are stored
/// separately: products of std::complex check for infinities, which is slow.
struct Amplification::Amplitudes {
  Amplitudes(int states, std::size_t columns)
      : real(Eigen::ArrayXXd::Zero(states, static_cast<Eigen::Index>(columns))),
        imaginary(real),
        is_zero(columns, true) {}

  void add(const Readings& readings, const std::complex<double>& factor,
           const std::vector<std::complex<double>>& phases, Eigen::Index to) {
    if (factor == 0.0) return;  // as the mean of every wave that is not constant
    for (const ComponentRow& reading : readings) {
      const Eigen::Index from = reading.component - most_states;
      if (from >= 0 && is_zero[static_cast<std::size_t>(from)]) continue;
      const std::complex<double> w = reading.at(phases);
      const double re = factor.real() * w.real() - factor.imag() * w.imag(),
                   im = factor.real() * w.imag() + factor.imag() * w.real();
      is_zero[static_cast<std::size_t>(to)] = false;
      if (from >= 0) {
        real.col(to) += re * real.col(from) - im * imaginary.col(from);
        imaginary.col(to) += re * imaginary.col(from) + im * real.col(from);
      } else {
        real(reading.component, to) += re;
        imaginary(reading.component, to) += im;
      }
    }
  }
  void multiply(const std::complex<double>& by, Eigen::Index column) {
    const Eigen::ArrayXd before = real.col(column);
    real.col(column) = by.real() * before - by.imag() * imaginary.col(column);
    imaginary.col(column) = by.real() * imaginary.col(column) + by.imag() * before;
  }

  Eigen::ArrayXXd real, imaginary;
  std::vector<bool> is_zero;
};

/// Sums of waves are rows, too, each computed from those before it. Multipliers are defined for angles up to pi, so
/// larger angles are replaced by their aliases.
Eigen::MatrixXcd Amplification::with_waves(const Angles& given) const {
  Angles angles = given;
  for (double& angle : angles) angle = std::remainder(angle, 2 * pi);
  const Phases along_axes = phases_of(angles);
  std::vector<std::complex<double>> phases;
  for (const stencil::Offset& offset : offsets_) phases.push_back(phase(along_axes, offset));
  std::vector<std::complex<double>> multipliers;
  for (const WaveMultiplier& by : multipliers_) multipliers.push_back(by.at(angles));
  Amplitudes amplitudes(size_, waves_.size() + rows_.size());
  Eigen::Index column = 0;
  for (const Wave& wave : waves_) {
    for (const auto& [readings, by] : wave.terms) amplitudes.add(readings, multipliers[by], phases, column);
    std::complex<double> divisor = 0;
    double size = 0;
    for (const ComponentRow& reading : wave.divisor) {
      divisor += reading.at(phases);
      for (const auto& [place, coefficient] : reading.weights) size += std::abs(coefficient);
    }
    const bool is_known = std::abs(divisor) > rounding * size;  // the solution in the null space is 0
    if (!wave.divisor.empty()) amplitudes.multiply(is_known ? 1.0 / divisor : 0.0, column);
    ++column;
  }
  for (const Readings& row : rows_) amplitudes.add(row, 1, phases, column++);
  Eigen::MatrixXcd result(size_, size_);
  result.real() = amplitudes.real.rightCols(size_).transpose();
  result.imag() = amplitudes.imaginary.rightCols(size_).transpose();
  return result;
}

/// For one or two states closed forms are faster, and more accurate.
void Amplification::expect_many_waves() {
  constexpr int of_closed_forms = 2;
  if (size_ <= of_closed_forms || !waves_.empty() || lines_.empty()) return;
  std::vector<Eigen::MatrixXd> weights;
  std::vector<stencil::Offset> places;
  for (const Line& line : lines_) {
    const double* of_place = line.weights.data();
    for (const int x : line.x) {
      places.push_back({x, line.y, line.z});
      weights.emplace_back(Eigen::Map<const Eigen::MatrixXd>(of_place, size_, size_));
      of_place += static_cast<std::ptrdiff_t>(size_) * size_;
    }
  }
  const std::optional<Eigen::MatrixXcd> diagonals = common_diagonals(std::move(weights));
  for (std::size_t i = 0; diagonals && i < places.size(); ++i)
    diagonals_.emplace_back(places[i], diagonals->col(static_cast<Eigen::Index>(i)));
}

Eigen::VectorXcd Amplification::eigenvalues(const Angles& angles) const {
  if (diagonals_.empty() || angles == Angles{}) return stability::eigenvalues(at(angles));
  const Phases phases = phases_of(angles);
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(size_);
  for (const auto& [place, diagonal] : diagonals_) sum += phase(phases, place) * diagonal;
  return sum;
}

namespace {

/// The initial samples: a lattice with all distinct signs, diagonals, and long waves.
std::vector<Angles> first_waves(int rank) {
  const int count = waves_along[static_cast<std::size_t>(rank - 1)];
  std::vector<Angles> result;
  // Half of all: G(-a) is the conjugate of G(a).
  for (int z = rank > 2 ? 0 : count / 2; z <= count / 2; ++z) {
    for (int y = rank > 2 ? -count / 2 + 1 : rank == 2 ? 0 : count / 2; y <= count / 2; ++y) {
      for (int x = rank > 1 ? -count / 2 + 1 : 0; x <= count / 2; ++x) {
        Angles a{2 * pi * x / count, 0, 0};
        if (rank > 1) a[1] = 2 * pi * y / count;
        if (rank > 2) a[2] = 2 * pi * z / count;
        if (a != Angles{}) result.push_back(a);
      }
    }
  }
  // Equal angles along several axes, finely: these waves limit advection in several dimensions.
  for (int direction = 0; rank > 1 && direction < static_cast<int>(std::pow(3, rank)); ++direction) {
    std::array<int, 3> sign{direction % 3 - 1, direction / 3 % 3 - 1, rank > 2 ? direction / 9 - 1 : 0};
    if (sign == std::array{0, 0, 0} || sign < std::array{0, 0, 0}) continue;  // the other half is conjugate
    for (int i = 1; i <= along_diagonals; ++i) {
      const double angle = pi * i / along_diagonals;
      result.push_back({sign[0] * angle, sign[1] * angle, sign[2] * angle});
    }
  }
  for (const double length : long_waves) {
    for (int direction = 1; direction < (1 << rank); ++direction) {
      Angles a{};
      for (int axis = 0; axis < rank; ++axis) a[static_cast<std::size_t>(axis)] = (direction >> axis) % 2 * length;
      result.push_back(a);
    }
  }
  return result;
}

/// Whether the wave is longer than all initial samples. There rounding is as large as the differences themselves, and
/// eigenvalues of equations of second order in time contain its square root.
bool is_too_long(int rank, const Angles& angles) {
  double longest = 0;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank); ++axis)
    longest = std::max(longest, std::abs(std::remainder(angles[axis], 2 * pi)));
  return longest < 0.99 * long_waves.back();
}

/// The known maximum within one step of `from`; null if there is none.
const Largest* top_within(double step, const Largest& from, const std::vector<Largest>& tops) {
  const auto is_near = [&](const Largest& top) {
    const auto is_far_along = [&](double a, double b) { return std::abs(a - b) > step; };
    return top.value >= from.value && std::ranges::equal(top.angles, from.angles, std::not_fn(is_far_along));
  };
  const auto found = std::ranges::find_if(tops, is_near);
  return found == tops.end() ? nullptr : &*found;
}

/// Climbs along each axis in turn. The step is doubled if one of its moves leads up, else halved, down to `shortest`.
/// Ends early at a maximum among `tops`, found by former climbs, that is within a step.
Largest climb(int rank, Largest from, double step, double shortest, const std::function<double(const Angles&)>& f,
              const std::vector<Largest>& tops = {}) {
  const double longest = 8 * step;
  while (step > shortest) {
    if (const Largest* top = top_within(step, from, tops)) return *top;
    bool has_moved = false;
    for (int way = 0; way < 2 * rank; ++way) {
      Angles next = from.angles;
      next[static_cast<std::size_t>(way / 2)] += way % 2 == 0 ? step : -step;
      if (is_too_long(rank, next)) continue;
      const double value = f(next);
      if (!(value > from.value + 1e-15 + worth_a_step * std::abs(from.value))) continue;
      from = {next, value};
      has_moved = true;
      break;
    }
    step = has_moved ? std::min(2 * step, longest) : step / 2;
  }
  return from;
}

}  // namespace

Largest largest_over_waves(int rank, const std::function<double(const Angles&)>& f) {
  std::vector<Largest> found;
  for (const Angles& angles : first_waves(rank)) found.push_back({angles, f(angles)});
  const auto is_larger = [](const Largest& a, const Largest& b) { return a.value > b.value; };
  const auto count = std::min<std::ptrdiff_t>(climbs, std::ssize(found));
  std::partial_sort(found.begin(), found.begin() + count, found.end(), is_larger);
  found.resize(static_cast<std::size_t>(count));
  const double step = pi / waves_along[static_cast<std::size_t>(rank - 1)];
  std::vector<Largest> tops;
  std::vector<double> shortest;
  for (const Largest& start : found) {
    // From a long wave the climb takes small steps.
    double smallest = step;
    for (const double a : start.angles) smallest = a == 0 ? smallest : std::min(smallest, std::abs(a) / 4);
    const Largest top = climb(rank, start, smallest, coarse_climb * smallest, f, tops);
    if (std::ranges::find(tops, top.angles, &Largest::angles) != tops.end()) continue;
    tops.push_back(top);
    shortest.push_back(coarse_climb * smallest);
  }
  Largest best = *std::ranges::max_element(tops, {}, &Largest::value);
  const double rival = best.value - near_the_best * std::max(std::abs(best.value), small_value);
  for (std::size_t i = 0; i < tops.size(); ++i) {
    if (!(tops[i].value >= rival)) continue;
    const Largest top = climb(rank, tops[i], shortest[i], finest_climb, f);
    if (top.value > best.value) best = top;
  }
  return best;
}

}  // namespace dpde::stability
