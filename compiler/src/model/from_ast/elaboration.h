// SPDX-License-Identifier: Apache-2.0
// What the parts of from_ast hand to one another: the chosen blocks, the names, and the problem as far as it is made.
// Each part reports what is wrong and goes on with something that causes no further messages.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/boundary/wall_image.h"
#include "model/from_ast.h"
#include "model/from_ast/names/names.h"
#include "model/model.h"
#include "network/network.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

/// An expression with its type. A `none` was reported already: whoever meets it stays silent.
struct TypedExpr {
  enum class Type { none, number, vector, tensor, condition } type = Type::none;
  std::vector<Expr> parts;  // of a vector one an axis, of a tensor one for two axes, row by row, otherwise one
};
inline TypedExpr number_of(Expr e) { return {TypedExpr::Type::number, {std::move(e)}}; }
/// `f` of each component.
template <class F>
TypedExpr map_parts(TypedExpr value, const F& f) {
  for (Expr& part : value.parts) part = f(part);
  return value;
}

/// What does not go with a row of a scheme, and what to write instead.
struct Obstacle {
  std::string what, hint;
};

/// The settings of --set, and which of them were asked for.
class Settings {
 public:
  explicit Settings(const std::map<std::string, std::string>& texts) : texts_(texts) {}
  /// The text given for `key`; `key` counts as known from now on.
  const std::string* find(const std::string& key);
  const std::map<std::string, std::string>& texts() const { return texts_; }
  const std::vector<std::string>& known() const { return known_; }
  void add_known(const std::string& key) { known_.push_back(key); }

 private:
  const std::map<std::string, std::string>& texts_;
  std::vector<std::string> known_;
};

/// The arguments of the function of the file that is being put in, and of which functions it is part.
struct FunctionScope {
  const ast::Function& function;
  std::map<std::string, TypedExpr> arguments;
  const FunctionScope* outer;
};

/// A network of the file. In a call a vector gives as many channels as there are axes, and gets as many.
struct DeclaredNetwork {
  const ast::Network* source = nullptr;
  std::optional<network::Network> network = {};  // none: reported
  bool vector = false;                           // its output; else a number, or
  std::vector<std::string> outputs = {};         // what is called so
  std::vector<bool> relative = {};  // for each input: it enters relative to its mean over the grid; none: none does
  struct Misfit {
    SourceRange range;
    std::string text, hint;
  };
  std::vector<Misfit> misfits = {};  // why its symmetries are none of this grid: an error where something calls it
};

/// The place of an inject or a sample that is not the same in every run.
struct OpenPlace {
  std::string callee;
  std::vector<Expr> position;
  SourceRange range;
};

/// The rate of a field inside the mask that holds it, else 0.
struct MaskForce {
  std::string mask;
  Expr rate;
};

/// The blocks of the text that the problem is made of.
struct ChosenBlocks {
  const ast::Task* task = nullptr;  // none when a scene is selected
  const ast::Scene* scene = nullptr;
  std::optional<ast::Model> coupled;      // of a scene of several models: their items together
  const ast::Model* model = nullptr;      // this, or
  const ast::Program* program = nullptr;  // this
};

/// Names that stand for formulas, and what else names mean.
struct ElaboratedNames {
  Scope scope;
  std::map<std::string, TypedExpr> lets;
  std::map<std::string, const ast::Expr*> scene_lets;
  bool are_too_deep = false;              // too many formulas of the scene name one another: reported
  std::map<std::string, int> axis_names;  // of coordinates, beside x, y and z: r, theta, lon, lat
};

struct ElaboratedParams {
  std::map<std::string, std::optional<double>> values;  // nullopt after an error
  std::set<std::string> unknowns;                       // of the task
  std::set<std::string> controls;                       // vary in time
  std::set<std::string> fixed;                          // something is made of them once: see made_once
  std::set<std::string> used;                           // parameters and coefficients that were read anywhere
};

struct ElaboratedNetworks {
  std::vector<DeclaredNetwork> declared;  // all of the file
  std::set<std::string> called;
};

struct ElaboratedSolves {
  std::set<std::string> solved;       // unknowns of the model's solves: lets with a boundary
  std::vector<State> guesses;         // first guesses of the next step: states, but not yet among them
  std::set<std::string> multipliers;  // fields that constraints give
};

struct ElaboratedMasks {
  std::map<std::string, MaskForce> forces;  // of fields that are held
  std::map<std::string, Expr> moving;       // those that hold t or controls: 1 inside, else 0
};

struct ElaboratedAverages {
  struct Average {
    std::string name;  // of the number that stands for it
    Expr value;
    Origin origin;
  };
  std::vector<Average> of_loss;  // of the loss that is being read
  bool are_taken = false;
  int count = 0;  // of all losses
};

struct Elaboration {
  Elaboration(const ast::File& file, const Selection& selection, DiagnosticSink& sink)
      : file(file), selection(selection), sink(sink), settings(selection.overrides) {}

  const ast::File& file;
  const Selection& selection;
  DiagnosticSink& sink;
  Settings settings;
  Problem problem;
  ChosenBlocks blocks;
  ElaboratedNames names;
  ElaboratedParams params;
  ElaboratedNetworks networks;
  ElaboratedSolves solves;
  ElaboratedMasks masks;
  ElaboratedAverages averages;
  std::vector<OpenPlace> open_places;        // of all formulas
  std::vector<WeightedSide> weighted_sides;  // as often as they are written for a field and an axis
  int expansions = 0;                        // of functions and operators of the file
};

/// Declares a name of the user; false, with a diagnostic, where it is taken or reserved.
bool declare(Elaboration& elaboration, const ast::Identifier& name, Role role, bool is_vector = false);
/// Declares the components of a vector, one an axis of the scene, and gives their names; of other names just the name.
std::vector<std::string> declare_components(Elaboration& elaboration, const std::string& name);
/// u.x, u.y of a vector u; of other names just the name.
std::vector<std::string> components_of(const Elaboration& elaboration, const std::string& written);
/// Reports a name that means nothing, the component of something that has none, or one along an axis there is not.
void report_unknown(Elaboration& elaboration, const ast::Identifier& name,
                    const std::function<std::vector<std::string>()>& candidates);
/// Reports that `name` was given before, at `first`.
void report_duplicate(Elaboration& elaboration, const std::string& what, SourceRange range, SourceRange first);
/// The states that `name` means: itself, or the components of a vector; none, and a diagnostic, when it is something
/// else: "only a field has `thing`".
std::vector<State*> find_states(Elaboration& elaboration, const ast::Identifier& name, const std::string& thing,
                                const std::string& hint = "");
/// "dt(u)" of a velocity u_t; other names as they are.
std::string written_name(const Elaboration& elaboration, const std::string& name);
/// The fields that are not among `seen`, of a vector with no component among them the vector.
std::vector<std::string> states_not_in(const Elaboration& elaboration, const std::map<std::string, SourceRange>& seen);

/// The axis that is called so; -1: none.
int axis_of(const Elaboration& elaboration, const std::string& name);
/// As the scene's coordinates call it: lat; else x, y, z.
std::string written_axis(const Elaboration& elaboration, std::size_t axis);

/// The items of one kind, in order.
template <class Kind>
struct Found {
  const Kind& kind;
  SourceRange range;
};
template <class Kind>
std::vector<Found<Kind>> items_of(const std::vector<ast::Item>& items) {
  std::vector<Found<Kind>> found;
  for (const ast::Item& item : items) {
    if (const auto* kind = get_if<Kind>(&item.kind)) found.push_back({*kind, item.range});
  }
  return found;
}

/// The declaration of this kind called `name`, or nullptr.
template <class Kind>
const Kind* find_declaration(const ast::File& file, const std::string& name) {
  for (const ast::Declaration& declaration : file.declarations) {
    const auto* kind = std::get_if<Kind>(&declaration.kind);
    if (kind && kind->name.name == name) return kind;
  }
  return nullptr;
}
template <class Kind>
std::vector<std::string> names_of(const ast::File& file) {
  std::vector<std::string> names;
  for (const ast::Declaration& declaration : file.declarations) {
    if (const auto* kind = std::get_if<Kind>(&declaration.kind)) names.push_back(kind->name.name);
  }
  return names;
}

}  // namespace dpde::model
