// SPDX-License-Identifier: Apache-2.0
// Item kinds by the blocks they occur in. For analyses of one block: match() with all kinds of that block, and one case
// for the others. A kind in none of these lists fails to compile there.
#pragma once

#include <type_traits>

#include "support/match.h"
#include "syntax/ast.h"

namespace dpde::ast {

template <class Kind, class... Kinds>
concept OneOf = (std::is_same_v<Kind, Kinds> || ...);

/// In kernels; LetItem also occurs in models.
template <class Kind>
concept InKernels = OneOf<Kind, LetItem, AssignItem, ScatterItem, AdjointItem>;
/// In programs; RepeatItem also occurs in networks.
template <class Kind>
concept InPrograms = OneOf<Kind, FillItem, ReduceItem, TransformItem, RunItem, SwapItem, StackItem, RepeatItem,
                           SolveItem, KeepItem, AxesItem, ApplyItem>;
/// In models, in addition to LetItem.
template <class Kind>
concept InModels =
    OneOf<Kind, FieldItem, CoefficientItem, ParamItem, ControlItem, EquationItem, SolvedItem, ConstraintItem, HeldItem>;
/// In scenes, in addition to LetItem.
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
