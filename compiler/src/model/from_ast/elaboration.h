// SPDX-License-Identifier: Apache-2.0
// Shared state of the parts of from_ast: the selected blocks, the names, and the problem as built so far. Each part
// reports its errors and continues with a replacement that causes no follow-up messages.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/boundary/wall_image.h"
#include "model/from_ast.h"
#include "model/from_ast/formulas/measures.h"
#include "model/from_ast/names/names.h"
#include "model/model.h"
#include "network/network.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

/// An expression with its type. `none` means: the error is already reported, so add no message.
struct TypedExpr {
  enum class Type { none, number, vector, tensor, condition } type = Type::none;
  std::vector<Expr> parts;  // one per axis for a vector, one per pair of axes (row by row) for a tensor, otherwise one
  MeasureList unit = {};    // empty for a sum, whose terms are compared where it is used, and if no unit is told
};
inline TypedExpr number_of(Expr e) { return {TypedExpr::Type::number, {std::move(e)}}; }
/// Applies `f` to each component.
template <class F>
TypedExpr map_parts(TypedExpr value, const F& f) {
  for (Expr& part : value.parts) part = f(part);
  return value;
}

/// A conflict with a line of a scheme, and the suggested change.
struct Obstacle {
  std::string what, hint;
};

/// The settings of --set, and the keys that were queried.
class Settings {
 public:
  explicit Settings(const std::map<std::string, std::string>& texts) : texts_(texts) {}
  /// The text given for `key`; marks `key` as known.
  const std::string* find(const std::string& key);
  const std::map<std::string, std::string>& texts() const { return texts_; }
  const std::vector<std::string>& known() const { return known_; }
  void add_known(const std::string& key) { known_.push_back(key); }

 private:
  const std::map<std::string, std::string>& texts_;
  std::vector<std::string> known_;
};

/// Arguments of the function of the file being expanded, and the functions that contain the call.
struct FunctionScope {
  const ast::Function& function;
  std::map<std::string, TypedExpr> arguments;
  const FunctionScope* outer;
};

/// A network of the file. A vector input gives one channel per axis, and so does a vector output.
struct DeclaredNetwork {
  const ast::Network* source = nullptr;
  std::optional<network::Network> network = {};  // nullopt: error reported
  bool vector = false;                           // the output is a vector; else a number, or
  std::vector<std::string> outputs = {};         // numbers with these names
  std::vector<bool> relative = {};  // for each input: taken relative to its mean over the grid; empty: none is
  struct Misfit {
    SourceRange range;
    std::string text, hint;
  };
  std::vector<Misfit> misfits = {};  // why its symmetries do not fit this grid: an error if the network is called
};

/// Position of an inject or a sample that varies between runs.
struct OpenPlace {
  std::string callee;
  std::vector<Expr> position;
  SourceRange range;
};

/// The time derivative of a field inside the mask that fixes it, 0 outside.
struct MaskForce {
  std::string mask;
  Expr rate;
};

/// The blocks of the text selected for the problem.
struct ChosenBlocks {
  const ast::Task* task = nullptr;  // null if a scene is selected
  const ast::Scene* scene = nullptr;
  std::optional<ast::Model> coupled;      // for a scene of several models: all their items
  const ast::Model* model = nullptr;      // this, or
  const ast::Program* program = nullptr;  // this
};

/// Meanings of names, and the formulas that names stand for.
struct ElaboratedNames {
  Scope scope;
  std::map<std::string, TypedExpr> lets;
  std::map<std::string, const ast::Expr*> scene_lets;
  bool are_too_deep = false;              // formulas of the scene are nested too deeply; reported
  std::map<std::string, int> axis_names;  // of coordinates, in addition to x, y and z: r, theta, lon, lat
  int expansions = 0;                     // of functions and operators of the file
};

struct ElaboratedParams {
  std::map<std::string, std::optional<double>> values;  // nullopt after an error
  std::set<std::string> unknowns;                       // of the task
  std::set<std::string> controls;                       // vary in time
  std::set<std::string> fixed;                          // their values were used at compile time: see made_once
  std::set<std::string> used;                           // parameters and coefficients that some formula reads
};

struct ElaboratedNetworks {
  std::vector<DeclaredNetwork> declared;  // all networks of the file
  std::set<std::string> called;
};

struct ElaboratedSolves {
  std::set<std::string> solved;       // unknowns of the model's solves: lets with a boundary
  std::vector<State> guesses;         // initial guesses of solves for the next step: future states
  std::set<std::string> multipliers;  // fields determined by constraints
};

struct ElaboratedMasks {
  std::map<std::string, MaskForce> forces;  // of fields fixed inside masks
  std::map<std::string, Expr> moving;       // masks that contain t or controls: 1 inside, else 0
};

struct ElaboratedAverages {
  struct Average {
    std::string name;  // of the number that stands for it
    Expr value;
    Origin origin;
  };
  std::vector<Average> of_loss;  // of the current loss
  bool are_taken = false;
  int count = 0;  // in all losses
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
  Measures measures;
  std::vector<OpenPlace> open_places;        // of all formulas
  std::vector<WeightedSide> weighted_sides;  // one for each field and axis of a line
};

/// Declares a name of the file; false, with a diagnostic, if it is taken or reserved.
bool declare(Elaboration& elaboration, const ast::Identifier& name, Role role, bool is_vector = false);
/// Declares the components of a vector, one per axis of the scene, and returns their names; for other names just the
/// name.
std::vector<std::string> declare_components(Elaboration& elaboration, const std::string& name);
/// u.x, u.y for a vector u; for other names just the name.
std::vector<std::string> components_of(const Elaboration& elaboration, const std::string& written);
/// Reports a name without meaning, a component of something without components, or of an axis that does not exist.
void report_unknown(Elaboration& elaboration, const ast::Identifier& name,
                    const std::function<std::vector<std::string>()>& candidates);
/// Reports that `name` was given before, at `first`.
void report_duplicate(Elaboration& elaboration, const std::string& what, SourceRange range, SourceRange first);
/// The states with this name: one, or the components of a vector; empty, after the diagnostic "only a field has
/// `thing`", for other names.
std::vector<State*> find_states(Elaboration& elaboration, const ast::Identifier& name, const std::string& thing,
                                const std::string& hint = "");
/// "dt(u)" for a velocity u_t; other names unchanged.
std::string written_name(const Elaboration& elaboration, const std::string& name);
/// The fields not in `seen`; a vector with no component in `seen` appears as the vector.
std::vector<std::string> states_not_in(const Elaboration& elaboration, const std::map<std::string, SourceRange>& seen);

/// The axis with this name, or -1.
int axis_of(const Elaboration& elaboration, const std::string& name);
/// The name in the scene's coordinates: lat; else x, y, z.
std::string written_axis(const Elaboration& elaboration, std::size_t axis);

/// The items of one kind, in file order.
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

/// The declaration of this kind with this name, or nullptr.
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
