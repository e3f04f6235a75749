// SPDX-License-Identifier: Apache-2.0
#include "random/renaming.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <vector>

#include "model/from_ast/names/names.h"
#include "support/match.h"
#include "support/names/units.h"
#include "support/split_mix.h"
#include "syntax/parse/lexer.h"
#include "syntax/parser.h"

namespace dpde::testing {

namespace {

/// What the passes, schemes and derivatives call things.
constexpr std::string_view favourites[] = {
    "t1",
    "t2",
    "t3",
    "u_next",
    "u_1",
    "u_2",
    "hx2",
    "noise_x",
    "m_step",
    "bar",
    "shared",
    "operand",
    "base",
    "u0",
    "u1",
    "u_wall",
    "u_mean",
    "velocity_step",
    "implicit_step",
    "u_rate_now",
    "u_old",
    "s_initial",
    "t_loss_1",
    "s_coefficients",
    "u_exact",
    "x_metric",
    "c1",
    "one",
    "dt2",
    "s_step_tangent",
};
/// Behind another name of the text.
constexpr std::string_view endings[] = {
    "_next",         "_1",       "_2",      "_3",     "_now",    "_rate_now", "_old",
    "_wall",         "_exact",   "_mean",   "_sum",   "_out",    "_step",     "_initial",
    "_coefficients", "_observe", "_loss_1", "_start", "_stage1", "_tangent",  "_adjoint",
    "_probe",        "_metric",  "_p1",     "_m1",    "_corner", "_before",   "_event1"};
/// A name with such an ending follows the one it belongs to.
constexpr std::string_view derived[] = {"_bar", "_dot", "_t"};
/// Words of the language, of its blocks and options.
const std::set<std::string> words{
    "at",      "over",    "time",        "from",     "in",       "to",        "on",         "by",       "for",
    "step",    "steps",   "every",       "cells",    "periodic", "stretched", "beside",     "above",    "grow",
    "halo",    "field",   "vector",      "param",    "data",     "scene",     "model",      "task",     "with",
    "order",   "scalar",  "courant",     "speed",    "batch",    "unroll",    "iterations", "runs",     "seed",
    "file",    "frames",  "coarsen",     "initial",  "low",      "high",      "all",        "axes",     "faces",
    "centres", "nodes",   "unknown",     "minimise", "test",     "observe",   "output",     "rate",     "using",
    "learn",   "control", "coefficient", "boundary", "exact",    "grid",      "vary",       "kernel",   "program",
    "run",     "fill",    "fold",        "swap",     "keep",     "reduce",    "apply",      "adjoint",  "tangent",
    "weights", "real",    "euler",       "rk2",      "rk4",      "verlet",    "ab2",        "leapfrog", "central",
    "upwind",  "cubic",   "linear",      "conv",     "dense",    "relu",      "tanh",       "gradient", "value",
    "mixed",   "mean",    "max",         "min",      "sum",      "growth",    "subcycle",   "epochs",   "cut",
    "noise",   "clip",    "validate",    "patience", "schedule", "trials",    "tolerance",  "absolute", "first",
    "about",   "mask",    "inside",      "gives"};

class NewNames {
 public:
  void add(const ast::Identifier& name) { add(name.name); }
  void add(const std::string& name) {
    if (!name.empty() && name != "_" && seen_.insert(name).second) all_.push_back(name);
  }
  void add(const std::vector<ast::Identifier>& names) {
    for (const ast::Identifier& name : names) add(name);
  }
  void item(const ast::Item& item) {
    match(
        item.kind, [&](const ast::FieldItem& i) { add(i.names); }, [&](const ast::CoefficientItem& i) { add(i.names); },
        [&](const ast::ParamItem& i) { add(i.names); }, [&](const ast::ControlItem& i) { add(i.names); },
        [&](const ast::LetItem& i) { add(i.name); }, [&](const ast::ObserveItem& i) { add(i.name); },
        [&](const ast::DataItem& i) { add(i.name); }, [&](const ast::TestItem& i) { add(i.name); },
        [&](const ast::ReduceItem& i) { add(i.result); }, [&](const ast::ApplyItem& i) { add(i.to); },
        [&](const ast::RepeatItem& i) { items(i.items); }, [](const auto&) {});
  }
  void items(const std::vector<ast::Item>& all) {
    for (const ast::Item& each : all) item(each);
  }
  void declaration(const ast::Declaration& d) {
    match(
        d.kind, [&](const ast::Model& m) { block(m); }, [&](const ast::Scene& s) { block(s); },
        [&](const ast::Scheme& s) { add(s.name); }, [&](const ast::Task& t) { block(t); },
        [&](const ast::Kernel& k) {
          for (const ast::KernelParameter& parameter : k.parameters) add(parameter.name);
          block(k);
        },
        [&](const ast::Program& p) { block(p); }, [&](const ast::Loop& l) { add(l.counter); },
        [&](const ast::Function& f) {
          add(f.name);
          add(f.parameters);
        },
        [](const ast::Import&) {},
        [&](const ast::Network& n) {
          for (const ast::Network::Input& input : n.inputs) add(input.name);
          add(n.name);
        },
        [&](const ast::DataSet& s) { add(s.name); }, [&](const ast::Chart& c) { add(c.name); });
  }
  const std::vector<std::string>& all() const { return all_; }

 private:
  template <class Block>
  void block(const Block& block) {
    add(block.name);
    items(block.items);
  }

  std::vector<std::string> all_;
  std::set<std::string> seen_;
};

/// Identifiers that no name may be changed to, and those that stay: components, names of arguments, and where the text
/// tells units what could be one.
struct Tokens {
  explicit Tokens(const ast::TokenStream& stream) {
    int parentheses = 0;
    for (std::size_t i = 0; i < stream.tokens.size(); ++i) {
      const ast::Token& token = stream.tokens[i];
      parentheses += token.kind == ast::TokenKind::left_paren ? 1 : token.kind == ast::TokenKind::right_paren ? -1 : 0;
      if (token.kind != ast::TokenKind::identifier) continue;
      there.insert(std::string(token.spelling));
      const bool is_component = i > 0 && stream.tokens[i - 1].kind == ast::TokenKind::dot;
      const bool is_argument = parentheses > 0 && stream.tokens[i + 1].kind == ast::TokenKind::assign;
      if (is_component || is_argument) staying.insert(std::string(token.spelling));
      const bool may_tell = i + 1 < stream.tokens.size() && token.spelling == "in";
      const std::string next(may_tell ? stream.tokens[i + 1].spelling : "");
      has_units = has_units || next == "1" || Unit::of_symbol(next);
    }
    for (const std::string& name : there) {
      if (has_units && Unit::of_symbol(name)) staying.insert(name);
    }
  }
  bool has_units = false;
  std::set<std::string> there, staying;
};

std::string follower(const std::string& name, const std::map<std::string, std::string>& names) {
  const auto found = names.find(name);
  if (found != names.end()) return found->second;
  for (const std::string_view ending : derived) {
    if (!name.ends_with(ending) || name.size() == ending.size()) continue;
    const std::string of = follower(name.substr(0, name.size() - ending.size()), names);
    if (!of.empty()) return of + std::string(ending);
  }
  return "";
}

bool is_derived(const std::string& name, const std::set<std::string>& others) {
  return std::ranges::any_of(derived, [&](std::string_view ending) {
    return name.ends_with(ending) && others.contains(name.substr(0, name.size() - ending.size()));
  });
}

class Chooser {
 public:
  Chooser(const std::set<std::string>& taken, std::uint64_t seed) : random_(seed), taken_(taken) {}

  std::string choose() {
    while (true) {
      std::string name(favourites[static_cast<std::size_t>(random_.below(std::size(favourites)))]);
      if (!chosen_.empty() && random_.percent(60))
        name = chosen_[static_cast<std::size_t>(random_.below(static_cast<int>(chosen_.size())))];
      if (tries_++ % 2 == 1 || std::ranges::find(chosen_, name) != chosen_.end())
        name += endings[static_cast<std::size_t>(random_.below(std::size(endings)))];
      if (model::is_reserved(name) || words.contains(name) || name.size() > 40 || !taken_.insert(name).second) continue;
      chosen_.push_back(name);
      return name;
    }
  }

 private:
  SplitMix random_;
  std::set<std::string> taken_;
  std::vector<std::string> chosen_;
  int tries_ = 0;
};

}  // namespace

std::string Renaming::operator()(const std::string& name) const {
  const std::string other = follower(name, names);
  return other.empty() ? name : other;
}

Renaming rename_all(const std::string& text, std::uint64_t seed) {
  const SourceFile source("renamed.dpde", text);
  DiagnosticSink sink;
  NewNames names;
  for (const ast::Declaration& d : parse(source, sink).declarations) names.declaration(d);
  const ast::TokenStream stream = ast::lex(source, sink);
  const Tokens tokens(stream);
  const std::set<std::string> declared(names.all().begin(), names.all().end());
  Chooser chooser(tokens.there, seed);
  Renaming result;
  std::vector<std::string> order = names.all();
  SplitMix random(seed);
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const std::string& name : order) {
    if (words.contains(name) || tokens.staying.contains(name) || model::axis_of(name) >= 0 ||
        (model::is_reserved(name) && name.find('_') == std::string::npos))
      continue;
    if (!is_derived(name, declared)) result.names[name] = chooser.choose();
  }
  std::size_t done = 0;
  for (std::size_t i = 0; i < stream.tokens.size(); ++i) {
    const ast::Token& token = stream.tokens[i];
    if (token.kind != ast::TokenKind::identifier || (i > 0 && stream.tokens[i - 1].kind == ast::TokenKind::dot))
      continue;
    const auto begin = static_cast<std::size_t>(token.spelling.data() - source.text().data());
    result.text += text.substr(done, begin - done) + result(std::string(token.spelling));
    done = begin + token.spelling.size();
  }
  result.text += text.substr(done);
  return result;
}

}  // namespace dpde::testing
