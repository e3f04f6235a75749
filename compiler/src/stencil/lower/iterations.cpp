// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/iterations.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "stencil/analyse/operator_traits.h"
#include "stencil/build.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

class Iterations {
 public:
  Iterations(const Solve& solve, const IterationFields& fields, Precision real, std::string name, Module& module,
             int rank)
      : solve_(solve),
        fields_(fields),
        negligible_(square(rounding_of(real))),
        name_(std::move(name)),
        module_(module),
        rank_(rank) {}

  /// Initialises the iteration from the right side and the start, without their means if A maps constants to 0.
  void begin(const std::string& start, bool without_means, std::vector<Statement>& body) const {
    const std::string& given = solve_.rights.front();
    Expr right = access(given), guess = start.empty() ? Expr(0.0) : access(start);
    if (without_means) right = right - mean_of(given, fields_.mean, body);
    if (without_means && !start.empty()) guess = guess - mean_of(start, fields_.mean_of_start, body);
    run("begin",
        {{fields_.x.state, 0.0},
         {fields_.left.state, right},
         {direction(), guess},
         {fields_.squares_at_start, square_of(right)},
         {fields_.size.state, 0.0}},
        body);
    reduce(fields_.square.state, Reduction::sum, fields_.squares_at_start, body);
  }

  Repeat passes(bool without_means) const {
    Repeat repeat{fields_.count + 1, solve_.body, {}};
    repeat.halos = solve_.halos;
    repeat.counter.name = fields_.pass;
    std::vector<Statement>& body = repeat.body;
    const Expr image = access(solve_.images.front()), from = access(direction());
    const Expr before = access(fields_.square.state), now = access(fields_.square.next);
    const Expr is_first = binary(BinaryOp::equal, param(fields_.pass), 0.0);
    const Expr is_found = binary(BinaryOp::less_equal, before, Expr(negligible_) * access(fields_.size.state));
    std::vector<Stored> products{{fields_.product, from * image}};
    if (solve_.preconditioner) products.emplace_back(fields_.ahead, access(fields_.left.state) * from);
    run("product", products, body);
    reduce(fields_.curvature, Reduction::sum, fields_.product, body);
    if (solve_.preconditioner) reduce(fields_.ahead_sum, Reduction::sum, fields_.ahead, body);
    const Expr along = solve_.preconditioner ? access(fields_.ahead_sum) : before;  // (r, p); plain CG: = (r, r)
    const Let length{"length", select(is_first, 1.0, select(is_found, 0.0, along / access(fields_.curvature)))};
    const Let left{"left", access(fields_.left.state) - local("length") * image};
    run("move",
        {{fields_.x.next, access(fields_.x.state) + local("length") * from},
         {fields_.left.next, local("left")},
         {fields_.squares, square_of(local("left"))}},
        body, {length, left});
    reduce(fields_.square.next, Reduction::sum, fields_.squares, body);
    Expr next = access(fields_.left.next), part = now / before;
    if (solve_.preconditioner) std::tie(next, part) = searched(without_means, body);
    const Let weight{"weight", select(is_first, 0.0, select(is_found, 0.0, part))};
    run("turn",
        {{fields_.direction.next, next + local("weight") * from},
         {fields_.size.next, select(is_first, before + now, access(fields_.size.state))}},
        body, {weight});
    repeat.carries = {fields_.x, fields_.left, fields_.direction, fields_.square, fields_.size};
    repeat.carries[2].state = direction();
    return repeat;
  }

 private:
  using Stored = std::pair<std::string, Expr>;

  /// z = M(r), or r if z is of no use, and the weight of the old direction in the next one.
  std::pair<Expr, Expr> searched(bool without_means, std::vector<Statement>& body) const {
    const NetworkCall& network = *solve_.preconditioner;
    const Expr left = access(fields_.left.next), image = access(solve_.images.front());
    const Expr square = access(fields_.square.next), is_nothing = binary(BinaryOp::equal, square, 0.0);
    const Let scale{"scale", call(Fn::sqrt, {select(is_nothing, 1.0, square) / param("cells")})};
    run("scale", {{network.inputs.front(), left / local("scale")}}, body, {scale});
    body.push_back(network);
    const std::string& made = network.results.front();
    const Expr mean = without_means ? mean_of(made, fields_.mean_of_made, body) : Expr(0.0);
    const Let towards{"towards", local("scale") * (access(made) - mean)};
    run("search",
        {{fields_.towards, local("towards")},
         {fields_.gains, local("towards") * left},
         {fields_.lengths, square_of(local("scale") * access(made))},  // the size for rounding, as in krylov.cpp
         {fields_.turns, local("towards") * image},
         {fields_.drifts, left * image}},
        body, {scale, towards});
    reduce(fields_.gain, Reduction::sum, fields_.gains, body);
    reduce(fields_.length, Reduction::sum, fields_.lengths, body);
    reduce(fields_.turned, Reduction::sum, fields_.turns, body);
    reduce(fields_.drift, Reduction::sum, fields_.drifts, body);
    const Expr rounding = Expr(std::sqrt(negligible_));
    const Expr is_useful = binary(BinaryOp::greater, call(Fn::abs, {access(fields_.gain)}),
                                  rounding * call(Fn::sqrt, {access(fields_.length)}) * call(Fn::sqrt, {square}));
    const Expr along_image = select(is_useful, access(fields_.turned), access(fields_.drift));
    return {select(is_useful, access(fields_.towards), left), -along_image / access(fields_.curvature)};
  }

  static double rounding_of(Precision real) { return real == Precision::f32 ? 0x1p-23 : 0x1p-52; }
  static double square(double value) { return value * value; }
  static Expr square_of(const Expr& e) { return e * e; }
  const std::string& direction() const { return solve_.unknowns.front(); }

  /// A reduction over all axes.
  void reduce(const std::string& result, Reduction kind, const std::string& field, std::vector<Statement>& body) const {
    Reduce reduction{result, kind, field};
    std::fill_n(reduction.over.begin(), rank_, true);
    body.push_back(reduction);
  }

  Expr mean_of(const std::string& field, const std::string& mean, std::vector<Statement>& body) const {
    reduce(mean, Reduction::mean, field, body);
    return access(mean);
  }

  void run(const char* what, const std::vector<Stored>& stores, std::vector<Statement>& body,
           std::vector<Let> lets = {}) const {
    Kernel kernel;
    kernel.name = name_ + "_" + what;
    kernel.rank = rank_;
    kernel.lets = std::move(lets);
    for (const auto& [field, value] : stores) kernel.stores.push_back({field, false, value, {}});
    body.push_back(Run{add_kernel(module_, std::move(kernel))});
  }

  const Solve& solve_;
  const IterationFields& fields_;
  double negligible_;  // relative size of squares
  std::string name_;
  Module& module_;
  int rank_;
};

}  // namespace

void add_iterations(const Solve& solve, const IterationFields& fields, const std::string& start, Precision real,
                    const std::string& name, Module& module, Program& program) {
  const bool is_singular = traits_of(module, program, solve).takes_constants_to_zero;
  const Iterations iterations(solve, fields, real, name, module, static_cast<int>(program.axes.size()));
  iterations.begin(start, is_singular, program.body);
  program.body.push_back(iterations.passes(is_singular));
}

}  // namespace dpde::stencil
