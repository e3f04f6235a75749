// SPDX-License-Identifier: Apache-2.0
// The grammar of a .dpde file as types. On this level names are as written and unresolved, every node has a source
// range, and comments are kept. `Error` marks an error that was already reported: code that finds it reports nothing
// more.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "support/variant.h"
#include "syntax/parse/layout.h"
#include "syntax/physics_items.h"
#include "syntax/program_items.h"
#include "syntax/task_items.h"

namespace dpde::ast {

/// A class and not a type alias, so that the copy functions of all kinds are compiled only once, in ast.cpp.
struct ItemKind
    : Variant<FieldItem, CoefficientItem, ParamItem, ControlItem, LetItem, EquationItem, SolvedItem, ConstraintItem,
              HeldItem, GridItem, CoordinatesItem, ValueItem, InitialItem, ExactItem, BoundaryItem, TimeItem, StepItem,
              EventItem, SubcycleItem, ObserveItem, OutputItem, DataItem, UnknownItem, MinimiseItem, LearnItem,
              UsingItem, TestItem, AssignItem, ScatterItem, AdjointItem, FillItem, ReduceItem, TransformItem, RunItem,
              SwapItem, StackItem, RepeatItem, SolveItem, KeepItem, AxesItem, ApplyItem, LayerItem, BranchItem,
              PaddingItem, StartItem, SymmetryItem, RealItem, HostItem, VaryItem, FramesItem, OptionItem, AccuracyItem,
              ReferenceItem, ChoicesItem, ErrorItem, CellsItem> {
  using Variant::Variant;
  ItemKind();
  ItemKind(const ItemKind& other);
  ItemKind(ItemKind&& other) noexcept;
  ItemKind& operator=(const ItemKind& other);
  ItemKind& operator=(ItemKind&& other) noexcept;
  ~ItemKind();
};
struct Item {
  ItemKind kind;
  SourceRange range;
  Trivia trivia;
};

// ---- declarations --------------------------------------------------------------------------------------------------
struct Model {  // model NAME { ... }
  Identifier name;
  std::vector<Item> items;
};
struct Scene {  // scene NAME : MODEL [, MODEL] [with SCHEME] { ... }     scene NAME = SCENE [with SCHEME] { ... }
  Identifier name, of;
  std::vector<Identifier> also;  // further models, after the first
  std::optional<Identifier> scheme;
  std::vector<Item> items;
  std::optional<Identifier> like = {};     // scene after `=`; with_whole_scenes inserts its items
  std::vector<std::string> left_out = {};  // items of that scene that are dropped here, as text
};
struct Scheme {  // scheme NAME { key = value; ... }
  Identifier name;
  std::vector<Item> items;  // ValueItem only
};
struct Task {  // task NAME : SCENE [with SCHEME] { ... }
  Identifier name, of;
  std::optional<Identifier> scheme;
  std::vector<Item> items;
};
struct Kernel {  // kernel NAME(u: field halo 1, out v: field, nu: param) [on 2 axes] { ... }
  Identifier name;
  std::vector<KernelParameter> parameters;
  std::optional<int> axes;                         // on 2 axes: needed if no offset in the body shows it
  std::vector<Item> items;                         // LetItem, AssignItem, ScatterItem, AdjointItem
  std::string copy_of = {};                        // name of the original kernel, for copies made by repeats
  std::map<std::string, std::string> copied = {};  // original names of its fields, by new name
};
struct Program {  // program NAME { fill ...; run ...; swap ... }
  Identifier name;
  std::vector<Item> items;
};
struct Loop {  // loop t in 0 .. 32 { wave_step }
  Identifier counter;
  int from = 0, to = 0;
  std::vector<Identifier> body;
};
struct Function {  // function f(a, b) = expr       operator lap9(u) order 2 = (u[+1, 0] + ...)/hx^2
  Identifier name;
  std::vector<Identifier> parameters;
  std::optional<int> order;  // only of operators, which read neighbours of their parameters
  Expr body;
  std::vector<AdjointItem> adjoints;  // only of operators: lines below the body
};

struct Import {  // import "flow.dpde"       its blocks follow those of this file
  std::string path;
  SourceRange range;  // of the path
};

/// network NAME(u: vector, nu) -> vector { ... }      below the model level with channel counts: network NAME(3) -> 2
struct Network {
  struct Input {
    Identifier name;
    bool vector = false;
  };
  Identifier name;
  std::vector<Input> inputs;
  std::vector<Identifier> outputs;  // empty: scalar; the word `scalar` or `vector`, or names
  std::optional<int> input_channels, output_channels;
  std::vector<Item> items;  // PaddingItem, StartItem, SymmetryItem, RealItem, and HostItem or LayerItem, BranchItem,
                            // RepeatItem or LetItem, AssignItem
};

/// dataset NAME : SCENE [with SCHEME] { runs 10; vary nu in 0.01 .. 0.1; ... }      runs of a scene, in one file
struct DataSet {
  Identifier name, of;
  std::optional<Identifier> scheme;
  std::vector<Item> items;  // VaryItem, FramesItem, OptionItem
};

/// chart NAME : SCENE [with SCHEME] { vary cells in 64, 128; ... }      speed against accuracy of a scene's variants
struct Chart {
  Identifier name, of;
  std::optional<Identifier> scheme;
  std::vector<Item> items;  // ReferenceItem, ChoicesItem, ErrorItem, OptionItem
};

struct DeclarationKind
    : std::variant<Model, Scene, Scheme, Task, Kernel, Program, Loop, Function, Import, Network, DataSet, Chart> {
  using variant::variant;
  DeclarationKind();
  DeclarationKind(const DeclarationKind& other);
  DeclarationKind(DeclarationKind&& other) noexcept;
  DeclarationKind& operator=(const DeclarationKind& other);
  DeclarationKind& operator=(DeclarationKind&& other) noexcept;
  ~DeclarationKind();
};
struct Declaration {
  DeclarationKind kind;
  SourceRange range;
  Trivia trivia;
  BlockLayout layout;
  bool imported = false;  // from an imported file
};

struct File {
  std::vector<Declaration> declarations;
  std::vector<std::string> trailing_comments;
};

}  // namespace dpde::ast
