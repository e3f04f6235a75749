// SPDX-License-Identifier: Apache-2.0
// Kinds of items by what they stand in, for analyses of one block: match() over all that stands in it, and the others
// in one case. A kind that is in none of these lists compiles in none of them.
#pragma once

#include <type_traits>

#include "support/match.h"
#include "syntax/ast.h"

namespace dpde::ast {

template <class Kind, class... Kinds>
concept OneOf = (std::is_same_v<Kind, Kinds> || ...);

/// Of kernels; LetItem stands in models too.
template <class Kind>
concept InKernels = OneOf<Kind, LetItem, AssignItem, ScatterItem, AdjointItem>;
/// Of programs; RepeatItem stands in networks too.
template <class Kind>
concept InPrograms = OneOf<Kind, FillItem, ReduceItem, TransformItem, RunItem, SwapItem, StackItem, RepeatItem,
                           SolveItem, KeepItem, AxesItem, ApplyItem>;
/// Of models, beside LetItem.
template <class Kind>
concept InModels =
    OneOf<Kind, FieldItem, CoefficientItem, ParamItem, ControlItem, EquationItem, SolvedItem, ConstraintItem, HeldItem>;
/// Of scenes, beside LetItem.
template <class Kind>
concept InScenes = OneOf<Kind, GridItem, CellsItem, CoordinatesItem, ValueItem, InitialItem, ExactItem, BoundaryItem,
                         TimeItem, StepItem, EventItem, SubcycleItem, ObserveItem, OutputItem, AccuracyItem>;
template <class Kind>
concept InOtherBlocks = OneOf<Kind, DataItem, UnknownItem, MinimiseItem, LearnItem, UsingItem, TestItem, LayerItem,
                              BranchItem, PaddingItem, StartItem, SymmetryItem, RealItem, HostItem, VaryItem,
                              FramesItem, OptionItem, ReferenceItem, ChoicesItem, ErrorItem>;
template <class Kind>
concept Elsewhere = InScenes<Kind> || InOtherBlocks<Kind>;

template <class Kind>
concept OutsidePrograms = InKernels<Kind> || InModels<Kind> || Elsewhere<Kind>;
template <class Kind>
concept OutsideModels = InKernels<Kind> || InPrograms<Kind> || Elsewhere<Kind>;
template <class Kind>
concept OutsideScenes =
    InPrograms<Kind> || InModels<Kind> || InOtherBlocks<Kind> || OneOf<Kind, AssignItem, ScatterItem, AdjointItem>;
template <class Kind>
concept OutsideKernels = InPrograms<Kind> || InModels<Kind> || Elsewhere<Kind>;

}  // namespace dpde::ast
