// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: expressions as straight-line IR. Every floating-point instruction carries `contract` (except
// Rounded products) and no other fast-math flag, so the optimiser cannot reorder terms.
#pragma once

#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>

#include <string>
#include <unordered_map>
#include <vector>

#include "codegen/llvm/emit_place.h"
#include "loop/loop.h"

namespace dpde::codegen {

/// IR values of the leaves, by index.
struct Leaves {
  std::vector<llvm::Value*> params, counters, uniforms, loads, lets;
};

class ExprEmitter {
 public:
  /// `real`: floating-point type of numbers and leaves. `place`: null outside of cells (definitions of uniforms).
  ExprEmitter(llvm::IRBuilder<>& builder, const Leaves& leaves, llvm::Type* real, PlaceEmitter* place)
      : builder_(builder), leaves_(leaves), real_(real), place_(place) {}

  llvm::Value* number(const loop::Expr& expr);     // a `real`
  llvm::Value* condition(const loop::Expr& expr);  // an i1
  /// Emits a number or a condition, for a let; its uses convert.
  llvm::Value* value(const loop::Expr& expr);
  llvm::Value* as_number(llvm::Value* value);
  std::vector<llvm::Value*> numbers(const std::vector<loop::Expr>& exprs);

 private:
  llvm::Value* emit(const loop::Node& node);
  llvm::Value* emit_rounded(const loop::Rounded& rounded);
  llvm::Value* emit_binary(const loop::Binary& binary);
  llvm::Value* emit_compare(const loop::Binary& binary);
  llvm::Value* emit_power(const loop::Binary& binary);
  llvm::Value* emit_call(const loop::Call& call);
  llvm::Value* constant(double value) const;
  llvm::Value* elementary(const std::string& name, const std::vector<llvm::Value*>& arguments);
  llvm::Value* as_condition(llvm::Value* value);

  llvm::IRBuilder<>& builder_;
  const Leaves& leaves_;
  llvm::Type* real_;
  PlaceEmitter* place_;
  // Expressions may share nodes; each node is emitted once.
  std::unordered_map<const loop::Node*, llvm::Value*> emitted_;
};

}  // namespace dpde::codegen
