// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/emit_elementary.h"

#include <llvm/IR/Constants.h>
#include <llvm/IR/Instructions.h>

#include <array>

#include "codegen/llvm/ir_lanes.h"
#include "support/assert.h"

namespace dpde::codegen {

namespace {

constexpr std::array<unsigned, 4> lane_counts{2, 4, 8, 16};
constexpr const char* prefix = "dpde_";
constexpr const char* mappings_attribute = "vector-function-abi-variant";
/// Attribute of vector functions; its value is the name of the elementary function.
constexpr const char* name_attribute = "dpde-elementary";

struct Formula {
  llvm::Value* value = nullptr;  // null: there is no formula
  llvm::Value* far = nullptr;    // lanes outside the range of the formula
};

/// Emits the formula of dpde/elementary.h for `count` numbers.
template <class T>
Formula formula_of(const std::string& name, llvm::IRBuilder<>& builder, unsigned count,
                   const std::vector<llvm::Value*>& arguments) {
  const elementary::Functions<IrLanes<T>> functions{IrLanes<T>(builder, count)};
  const IrNumber x{arguments.at(0), &builder};
  const auto formula = [](const auto& result) { return Formula{result.value.value, result.far.value}; };
  if (name == "sin") return formula(functions.sin(x));
  if (name == "cos") return formula(functions.cos(x));
  if (name == "tan") return formula(functions.tan(x));
  if (name == "asin") return formula(functions.asin(x));
  if (name == "acos") return formula(functions.acos(x));
  if (name == "atan") return formula(functions.atan(x));
  if (name == "exp") return formula(functions.exp(x));
  if (name == "log") return formula(functions.log(x));
  if (name == "sinh") return formula(functions.sinh(x));
  if (name == "cosh") return formula(functions.cosh(x));
  if (name == "tanh") return formula(functions.tanh(x));
  if (name == "erf") return formula(functions.erf(x));
  if (name == "pow") return formula(functions.pow(x, {arguments.at(1), &builder}));
  return {};
}

void promise_pure(llvm::Function& function) {
  function.setDoesNotThrow();
  function.setWillReturn();
  function.setDoesNotAccessMemory();
}

llvm::FunctionType* type_of(const std::vector<llvm::Value*>& arguments) {
  llvm::Type* scalar = arguments.at(0)->getType()->getScalarType();
  return llvm::FunctionType::get(scalar, std::vector<llvm::Type*>(arguments.size(), scalar), false);
}

/// Calls the C library for each lane.
llvm::Value* emit_library(llvm::IRBuilder<>& builder, const std::string& name, unsigned count,
                          const std::vector<llvm::Value*>& arguments) {
  if (count == 1) return call_library(builder, name, arguments);
  llvm::Value* result = llvm::PoisonValue::get(arguments[0]->getType());
  for (unsigned lane = 0; lane < count; ++lane) {
    std::vector<llvm::Value*> of_lane;
    for (llvm::Value* argument : arguments) of_lane.push_back(builder.CreateExtractElement(argument, lane));
    result = builder.CreateInsertElement(result, call_library(builder, name, of_lane), lane);
  }
  return result;
}

/// Defines value = formula; lanes outside its range call the C library.
void define(llvm::Function& function, const std::string& name, unsigned count) {
  llvm::IRBuilder<> builder(llvm::BasicBlock::Create(function.getContext(), "near", &function));
  std::vector<llvm::Value*> arguments;
  for (llvm::Argument& argument : function.args()) arguments.push_back(&argument);
  const bool is_single = function.getReturnType()->getScalarType()->isFloatTy();
  const Formula formula = is_single ? formula_of<float>(name, builder, count, arguments)
                                    : formula_of<double>(name, builder, count, arguments);
  const auto from_library = [&] { return emit_library(builder, name, count, arguments); };
  function.setLinkage(llvm::Function::InternalLinkage);
  if (formula.value == nullptr) {
    builder.CreateRet(from_library());
    return;
  }
  if (llvm::isa<llvm::Constant>(formula.far)) {
    builder.CreateRet(formula.value);
    return;
  }
  auto* far = llvm::BasicBlock::Create(function.getContext(), "far", &function);
  auto* done = llvm::BasicBlock::Create(function.getContext(), "done", &function);
  llvm::BasicBlock* near = builder.GetInsertBlock();
  builder.CreateCondBr(count == 1 ? formula.far : builder.CreateOrReduce(formula.far), far, done);
  builder.SetInsertPoint(far);
  llvm::Value* mixed = builder.CreateSelect(formula.far, from_library(), formula.value);
  builder.CreateBr(done);
  builder.SetInsertPoint(done);
  llvm::PHINode* value = builder.CreatePHI(function.getReturnType(), 2);
  value->addIncoming(formula.value, near);
  value->addIncoming(mixed, far);
  builder.CreateRet(value);
}

std::string vector_name(const std::string& scalar, unsigned count) { return scalar + "_" + std::to_string(count); }

/// Declares the vector functions. Returns the LLVM attribute of the caller that lists them: _ZGV_LLVM_N<lanes><v for
/// each argument>_<function>(<vector function>).
std::string declare_vectors(llvm::Module& module, const std::string& name, const std::string& scalar,
                            llvm::FunctionType* type) {
  std::string mappings;
  for (const unsigned count : lane_counts) {
    llvm::Type* vector = llvm::FixedVectorType::get(type->getReturnType(), count);
    auto* of_vectors = llvm::FunctionType::get(vector, std::vector<llvm::Type*>(type->getNumParams(), vector), false);
    auto* function =
        llvm::Function::Create(of_vectors, llvm::Function::ExternalLinkage, vector_name(scalar, count), module);
    promise_pure(*function);
    function->addFnAttr(name_attribute, name);
    mappings += (mappings.empty() ? "" : ",") + ("_ZGV_LLVM_N" + std::to_string(count)) +
                std::string(type->getNumParams(), 'v') + "_" + scalar + "(" + vector_name(scalar, count) + ")";
  }
  return mappings;
}

llvm::Function* function_of(llvm::Module& module, const std::string& name, llvm::FunctionType* type) {
  const std::string symbol = prefix + name + (type->getReturnType()->isFloatTy() ? "f" : "");
  if (llvm::Function* known = module.getFunction(symbol)) return known;
  auto* function = llvm::Function::Create(type, llvm::Function::ExternalLinkage, symbol, module);
  promise_pure(*function);
  function->addFnAttr(llvm::Attribute::NoInline);
  function->addFnAttr(mappings_attribute, declare_vectors(module, name, symbol, type));
  define(*function, name, 1);
  return function;
}

}  // namespace

llvm::Value* call_elementary(llvm::IRBuilder<>& builder, const std::string& name,
                             const std::vector<llvm::Value*>& arguments) {
  return builder.CreateCall(function_of(*builder.GetInsertBlock()->getModule(), name, type_of(arguments)), arguments);
}

llvm::Value* call_library(llvm::IRBuilder<>& builder, const std::string& name,
                          const std::vector<llvm::Value*>& arguments) {
  llvm::FunctionType* type = type_of(arguments);
  llvm::FunctionCallee callee = builder.GetInsertBlock()->getModule()->getOrInsertFunction(
      type->getReturnType()->isFloatTy() ? name + "f" : name, type);
  promise_pure(*llvm::cast<llvm::Function>(callee.getCallee()));
  return builder.CreateCall(callee, arguments);
}

void define_vector_functions(llvm::Module& module) {
  for (llvm::Function& function : llvm::make_early_inc_range(module)) {
    if (!function.hasFnAttribute(name_attribute)) continue;
    if (function.use_empty()) {
      function.eraseFromParent();
      continue;
    }
    const std::string symbol = function.getName().str();
    const llvm::Function* scalar = module.getFunction(symbol.substr(0, symbol.rfind('_')));
    require(scalar != nullptr, "a function of vectors stands beside that of one number");
    const auto* type = llvm::cast<llvm::FixedVectorType>(function.getReturnType());
    for (const char* attribute : {"target-cpu", "target-features"})
      function.addFnAttr(scalar->getFnAttribute(attribute));
    function.addFnAttr("prefer-vector-width", std::to_string(type->getPrimitiveSizeInBits().getFixedValue()));
    define(function, function.getFnAttribute(name_attribute).getValueAsString().str(), type->getNumElements());
  }
}

}  // namespace dpde::codegen
