// SPDX-License-Identifier: Apache-2.0
#include "random/written_out.h"

#include <fmt/format.h>

#include <map>

#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::testing {

using namespace stencil;

namespace {

using Renamed = std::map<std::string, std::string>;
using Numbers = std::map<std::string, Expr>;

std::string name_in(const Renamed& names, const std::string& field) {
  const auto found = names.find(field);
  return found == names.end() ? field : found->second;
}

Expr renamed(const Expr& e, const Renamed& names, const Numbers& numbers) {
  return substitute_params(rename_fields(e, [&](const std::string& field) { return name_in(names, field); }), numbers);
}

std::vector<AxisBoundary> renamed(const std::vector<AxisBoundary>& axes, const Renamed& names, const Numbers& numbers) {
  return map_sides(axes, [&](const Expr& e) { return renamed(e, names, numbers); });
}

Kernel renamed(const Kernel& kernel, const Renamed& names, const Numbers& numbers, std::string name) {
  Kernel result = map_expressions(kernel, [&](const Expr& e) { return renamed(e, names, numbers); });
  result.name = std::move(name);
  for (Store& store : result.stores) store.field = name_in(names, store.field);
  for (Scatter& scatter : result.scatters) scatter.target.field = name_in(names, scatter.target.field);
  result.custom_adjoints.clear();
  return result;
}

class Writer {
 public:
  explicit Writer(const Module& module) : module_(module), result_(module) {}

  Module run(const std::string& name) {
    for (Program& program : result_.programs) {
      if (program.name == name) program.body = written(program.body);
    }
    return std::move(result_);
  }

 private:
  std::vector<Statement> written(const std::vector<Statement>& statements) {
    std::vector<Statement> body;
    for (const Statement& statement : statements) {
      const Repeat* repeat = std::get_if<Repeat>(&statement);
      if (repeat == nullptr) body.push_back(statement);
      if (repeat != nullptr) add_passes(*repeat, body);
    }
    return body;
  }

  void add_passes(const Repeat& repeat, std::vector<Statement>& body) {
    const Effects known = effects(module_, repeat);
    Renamed names;
    for (int pass = 1; pass <= repeat.count; ++pass) {
      Renamed states;
      for (const LoopCarried& carry : repeat.carries)
        states[carry.state] = name_in(names, pass > 1 ? carry.next : carry.state);
      names = states;
      for (const std::string& field : known.block_locals) names[field] = fmt::format("{}_pass{}", field, pass);
      if (pass == repeat.count) {
        for (const LoopCarried& carry : repeat.carries) names[carry.next] = carry.result;
      }
      const double number = repeat.counter.is_backwards ? repeat.count - pass : pass - 1;
      for (const Statement& statement : repeat.body)
        add(statement, names, {{repeat.counter.name, Expr(number)}}, pass, body);
    }
  }

  void add(const Statement& statement, const Renamed& names, const Numbers& numbers, int pass,
           std::vector<Statement>& body) {
    const auto name = [&](const std::string& field) { return name_in(names, field); };
    match(
        statement,
        [&](const Fill& fill) {
          body.push_back(Fill{name(fill.field), renamed(fill.axes, names, numbers)});
        },
        [&](const Fold& fold) {
          body.push_back(Fold{name(fold.field), fold.grow, renamed(fold.axes, names, numbers)});
        },
        [&](const Reduce& reduce) {
          body.push_back(Reduce{name(reduce.result), reduce.kind, name(reduce.field), reduce.over});
        },
        [&](const NetworkCall& network_call) { body.push_back(network_call); },
        [&](Transform transform) {
          for (Transform::Term& term : transform.terms) {
            term = {name(term.field), term.by};
            term.by.argument = substitute_params(term.by.argument, numbers);
            term.by.factor = substitute_params(term.by.factor, numbers);
          }
          transform.result = name(transform.result);
          body.push_back(std::move(transform));
        },
        [&](const Run& run) {
          const std::string kernel = fmt::format("{}_pass{}", run.kernel, pass);
          if (!result_.find_kernel(kernel))
            result_.kernels.push_back(renamed(*module_.find_kernel(run.kernel), names, numbers, kernel));
          body.push_back(Run{kernel, run.grow});
        },
        [&](Solve solve) {
          for (auto* fields : {&solve.images, &solve.rights, &solve.unknowns}) {
            for (std::string& field : *fields) field = name(field);
          }
          std::vector<Statement> block;
          for (const Statement& inner : solve.body) add(inner, names, numbers, pass, block);
          solve.body = std::move(block);
          body.push_back(std::move(solve));
        },
        [&](const Repeat& repeat) { body.push_back(repeat); });
  }

  const Module& module_;
  Module result_;
};

}  // namespace

Module written_out(const Module& module, const std::string& program) { return Writer(module).run(program); }

}  // namespace dpde::testing
