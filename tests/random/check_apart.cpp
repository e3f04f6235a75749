// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <sstream>

#include "random/check_program.h"
#include "random/isolated.h"

namespace dpde::testing {

namespace {

/// A line of numbers, a line with the check, and the detail with its length.
std::string as_text(const std::vector<Verdict>& verdicts) {
  std::string text;
  for (const Verdict& v : verdicts) {
    text += fmt::format("{} {} {} {} {} {}\n{}\n{}\n", static_cast<int>(v.kind), v.dot_product, v.finite_difference,
                        v.back_end, v.divided, v.detail.size(), v.check, v.detail);
  }
  return text;
}

std::vector<Verdict> from_text(const std::string& text) {
  std::vector<Verdict> verdicts;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    Verdict v;
    int kind = 0;
    std::size_t size = 0;
    std::string numbers[3];
    std::istringstream(line) >> kind >> numbers[0] >> numbers[1] >> numbers[2] >> v.divided >> size;
    v.kind = static_cast<Verdict::Kind>(kind);
    double* const values[3] = {&v.dot_product, &v.finite_difference, &v.back_end};
    for (int i = 0; i < 3; ++i) *values[i] = std::strtod(numbers[i].c_str(), nullptr);  // streams do not read nan
    std::getline(in, v.check);
    v.detail.resize(size);
    in.read(v.detail.data(), static_cast<std::streamsize>(size));
    in.get();
    verdicts.push_back(std::move(v));
  }
  return verdicts;
}

std::vector<Verdict> apart(const std::function<std::vector<Verdict>()>& check, std::size_t count, double seconds) {
  const Answer answer = isolated([&] { return as_text(check()); }, seconds);
  if (answer.kind == Answer::Kind::given) return from_text(answer.text);
  Verdict none{Verdict::Kind::failed, "crash", answer.text};
  if (answer.kind == Answer::Kind::late) none = {Verdict::Kind::failed, "time", fmt::format("more than {} s", seconds)};
  return std::vector<Verdict>(count, none);
}

}  // namespace

Verdict check_apart(const RandomProgram& program, const Checks& checks, double seconds) {
  return apart([&] { return std::vector{check_program(program, checks)}; }, 1, seconds).at(0);
}

std::vector<Verdict> check_in_cpp_apart(const std::vector<RandomProgram>& programs, double seconds) {
  return apart([&] { return check_in_cpp(programs); }, programs.size(), seconds);
}

}  // namespace dpde::testing
