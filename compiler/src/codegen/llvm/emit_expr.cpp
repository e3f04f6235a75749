// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/emit_expr.h"

#include <cmath>
#include <optional>

#include "codegen/elementary_functions.h"
#include "codegen/llvm/emit_elementary.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::codegen {

namespace {

/// Powers up to this exponent are products.
constexpr int largest_expanded_power = 16;

std::optional<double> constant_of(const loop::Expr& expr) {
  if (const auto* literal = as<Literal>(expr)) return literal->value;
  if (const auto* neg = as<loop::Neg>(expr)) {
    if (const std::optional<double> value = constant_of(neg->operand)) return -*value;
  }
  return std::nullopt;
}

/// The exponent if it is an integer small enough for products.
std::optional<int> small_integer(const loop::Expr& expr) {
  const std::optional<double> value = constant_of(expr);
  if (!value || std::abs(*value) > largest_expanded_power || *value != std::floor(*value)) return std::nullopt;
  return static_cast<int>(*value);
}

llvm::CmpInst::Predicate predicate(BinaryOp op) {
  switch (op) {
    case BinaryOp::less: return llvm::CmpInst::FCMP_OLT;
    case BinaryOp::less_equal: return llvm::CmpInst::FCMP_OLE;
    case BinaryOp::greater: return llvm::CmpInst::FCMP_OGT;
    case BinaryOp::greater_equal: return llvm::CmpInst::FCMP_OGE;
    case BinaryOp::equal: return llvm::CmpInst::FCMP_OEQ;
    case BinaryOp::not_equal: return llvm::CmpInst::FCMP_UNE;
    case BinaryOp::add:
    case BinaryOp::subtract:
    case BinaryOp::multiply:
    case BinaryOp::divide:
    case BinaryOp::power:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: break;
  }
  unreachable("not a comparison");
}

}  // namespace

llvm::Value* ExprEmitter::number(const loop::Expr& expr) { return as_number(value(expr)); }

llvm::Value* ExprEmitter::condition(const loop::Expr& expr) { return as_condition(value(expr)); }

std::vector<llvm::Value*> ExprEmitter::numbers(const std::vector<loop::Expr>& exprs) {
  std::vector<llvm::Value*> values;
  for (const loop::Expr& expr : exprs) values.push_back(number(expr));
  return values;
}

llvm::Value* ExprEmitter::value(const loop::Expr& expr) {
  const auto found = emitted_.find(&expr.node());
  if (found != emitted_.end()) return found->second;
  llvm::Value* result = emit(expr.node());
  emitted_.emplace(&expr.node(), result);
  return result;
}

/// Rounds once to `real`; constants were folded in double precision.
llvm::Value* ExprEmitter::constant(double value) const { return llvm::ConstantFP::get(real_, value); }

llvm::Value* ExprEmitter::as_number(llvm::Value* value) {
  return value->getType()->isFloatingPointTy() ? value : builder_.CreateUIToFP(value, real_);
}

llvm::Value* ExprEmitter::as_condition(llvm::Value* value) {
  if (!value->getType()->isFloatingPointTy()) return value;
  return builder_.CreateFCmpUNE(value, constant(0.0));
}

llvm::Value* ExprEmitter::emit(const loop::Node& node) {
  return match(
      node.kind, [&](const Literal& literal) -> llvm::Value* { return constant(literal.value); },
      [&](const loop::Uniform& uniform) { return leaves_.uniforms.at(uniform.index); },
      [&](const loop::Param& param) { return leaves_.params.at(param.index); },
      [&](const loop::Counter& counter) { return leaves_.counters.at(counter.index); },
      [&](const loop::Load& load) { return leaves_.loads.at(load.stream); },
      [&](const loop::Local& local) { return leaves_.lets.at(local.index); },
      [&](const loop::Inside& inside) { return place_->inside(inside); },
      [&](const loop::Interp& interp) { return place_->interp(interp, numbers(interp.displacement)); },
      [&](const loop::Neg& neg) { return builder_.CreateFNeg(number(neg.operand)); },
      [&](const loop::Rounded& rounded) { return emit_rounded(rounded); },
      [&](const loop::Binary& binary) { return emit_binary(binary); },
      [&](const loop::Call& call) { return emit_call(call); },
      [&](const loop::Select& select) {
        llvm::Value* condition_value = condition(select.condition);
        llvm::Value* yes = number(select.yes);
        return builder_.CreateSelect(condition_value, yes, number(select.no));
      });
}

/// Emits the product without `contract`, so that it is rounded.
llvm::Value* ExprEmitter::emit_rounded(const loop::Rounded& rounded) {
  llvm::Value* result = number(rounded.operand);
  auto* product = llvm::dyn_cast<llvm::Instruction>(result);
  if (product != nullptr && product->getOpcode() == llvm::Instruction::FMul) product->setHasAllowContract(false);
  return result;
}

llvm::Value* ExprEmitter::emit_binary(const loop::Binary& binary) {
  switch (binary.op) {
    case BinaryOp::power: return emit_power(binary);
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal: return emit_compare(binary);
    case BinaryOp::add:
    case BinaryOp::subtract:
    case BinaryOp::multiply:
    case BinaryOp::divide:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: break;
  }
  if (binary.op == BinaryOp::logical_and || binary.op == BinaryOp::logical_or) {
    llvm::Value* left = condition(binary.left);
    llvm::Value* right = condition(binary.right);
    return binary.op == BinaryOp::logical_and ? builder_.CreateAnd(left, right) : builder_.CreateOr(left, right);
  }
  llvm::Value* left = number(binary.left);
  llvm::Value* right = number(binary.right);
  if (binary.op == BinaryOp::add) return builder_.CreateFAdd(left, right);
  if (binary.op == BinaryOp::subtract) return builder_.CreateFSub(left, right);
  if (binary.op == BinaryOp::multiply) return builder_.CreateFMul(left, right);
  return builder_.CreateFDiv(left, right);
}

llvm::Value* ExprEmitter::emit_compare(const loop::Binary& binary) {
  llvm::Value* left = number(binary.left);
  return builder_.CreateFCmp(predicate(binary.op), left, number(binary.right));
}

llvm::Value* ExprEmitter::emit_power(const loop::Binary& binary) {
  llvm::Value* base = number(binary.left);
  const std::optional<int> exponent = small_integer(binary.right);
  if (!exponent) return elementary("pow", {base, number(binary.right)});
  llvm::Value* one = constant(1.0);
  llvm::Value* product = nullptr;
  llvm::Value* square = base;
  for (int rest = std::abs(*exponent); rest != 0; rest >>= 1) {
    if (rest & 1) product = product == nullptr ? square : builder_.CreateFMul(product, square);
    if (rest > 1) square = builder_.CreateFMul(square, square);
  }
  if (product == nullptr) return one;
  return *exponent < 0 ? builder_.CreateFDiv(one, product) : product;
}

/// Rows call the module's own functions, which give the same bits in all lanes. Uniforms are computed once and call the
/// C library.
llvm::Value* ExprEmitter::elementary(const std::string& name, const std::vector<llvm::Value*>& arguments) {
  return place_ == nullptr ? call_library(builder_, name, arguments) : call_elementary(builder_, name, arguments);
}

llvm::Value* ExprEmitter::emit_call(const loop::Call& call) {
  const std::vector<llvm::Value*> arguments = numbers(call.arguments);
  llvm::Value* x = arguments.at(0);
  const auto intrinsic = [&](llvm::Intrinsic::ID id) { return builder_.CreateUnaryIntrinsic(id, x); };
  if (is_elementary(call.fn)) return elementary(std::string(name_of(call.fn)), arguments);
  switch (call.fn) {
    case Fn::sqrt: return intrinsic(llvm::Intrinsic::sqrt);
    case Fn::abs: return intrinsic(llvm::Intrinsic::fabs);
    case Fn::floor: return intrinsic(llvm::Intrinsic::floor);
    case Fn::fraction: return builder_.CreateFSub(x, intrinsic(llvm::Intrinsic::floor));
    case Fn::sign: {
      llvm::Value* negative = builder_.CreateSelect(builder_.CreateFCmpOLT(x, constant(0)), constant(-1), constant(0));
      return builder_.CreateSelect(builder_.CreateFCmpOGT(x, constant(0)), constant(1), negative);
    }
    case Fn::min: return builder_.CreateSelect(builder_.CreateFCmpOLT(arguments.at(1), x), arguments.at(1), x);
    case Fn::max: return builder_.CreateSelect(builder_.CreateFCmpOLT(x, arguments.at(1)), arguments.at(1), x);
    case Fn::sin:
    case Fn::cos:
    case Fn::tan:
    case Fn::asin:
    case Fn::acos:
    case Fn::atan:
    case Fn::sinh:
    case Fn::cosh:
    case Fn::tanh:
    case Fn::exp:
    case Fn::log:
    case Fn::erf: break;
  }
  unreachable("function");
}

}  // namespace dpde::codegen
