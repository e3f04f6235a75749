// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: IR values as the number type of dpde/elementary.h, scalars or vectors. No instruction
// carries a fast-math flag: elementary.h states every fused operation explicitly.
#pragma once

#include <llvm/IR/IRBuilder.h>

#include <type_traits>

#include "dpde/elementary.h"

namespace dpde::codegen {

/// `Kind` distinguishes numbers, bits and booleans.
template <class Kind>
struct IrValue {
  llvm::Value* value;
  llvm::IRBuilder<>* builder;
};
using IrNumber = IrValue<struct NumberKind>;
using IrBits = IrValue<struct BitsKind>;
using IrTruth = IrValue<struct TruthKind>;

inline IrNumber operator+(IrNumber a, IrNumber b) { return {a.builder->CreateFAdd(a.value, b.value), a.builder}; }
inline IrNumber operator-(IrNumber a, IrNumber b) { return {a.builder->CreateFSub(a.value, b.value), a.builder}; }
inline IrNumber operator*(IrNumber a, IrNumber b) { return {a.builder->CreateFMul(a.value, b.value), a.builder}; }
inline IrNumber operator/(IrNumber a, IrNumber b) { return {a.builder->CreateFDiv(a.value, b.value), a.builder}; }
inline IrNumber operator-(IrNumber a) { return {a.builder->CreateFNeg(a.value), a.builder}; }
inline IrTruth operator&(IrTruth a, IrTruth b) { return {a.builder->CreateAnd(a.value, b.value), a.builder}; }
inline IrTruth operator|(IrTruth a, IrTruth b) { return {a.builder->CreateOr(a.value, b.value), a.builder}; }
inline IrBits operator+(IrBits a, IrBits b) { return {a.builder->CreateAdd(a.value, b.value), a.builder}; }
inline IrBits operator-(IrBits a, IrBits b) { return {a.builder->CreateSub(a.value, b.value), a.builder}; }
inline IrBits operator&(IrBits a, IrBits b) { return {a.builder->CreateAnd(a.value, b.value), a.builder}; }
inline IrBits operator|(IrBits a, IrBits b) { return {a.builder->CreateOr(a.value, b.value), a.builder}; }
inline IrBits operator^(IrBits a, IrBits b) { return {a.builder->CreateXor(a.value, b.value), a.builder}; }
inline IrBits operator<<(IrBits a, int places) { return {a.builder->CreateShl(a.value, places), a.builder}; }
inline IrBits operator>>(IrBits a, int places) { return {a.builder->CreateLShr(a.value, places), a.builder}; }

/// The Lanes of dpde/elementary.h; `T` is double or float.
template <class T>
class IrLanes {
 public:
  using Scalar = T;
  using Number = IrNumber;
  using Bits = IrBits;
  using Truth = IrTruth;
  using Wide = IrLanes<double>;

  /// `count` 1: a scalar.
  IrLanes(llvm::IRBuilder<>& builder, unsigned count) : builder_(&builder), count_(count) {}

  llvm::Type* type() const { return of(std::is_same_v<T, float> ? builder_->getFloatTy() : builder_->getDoubleTy()); }
  IrNumber number(double c) const { return made(llvm::ConstantFP::get(type(), c)); }
  IrBits integer(uint64_t c) const { return {llvm::ConstantInt::get(bits_type(), c), builder_}; }
  IrTruth no() const { return {llvm::Constant::getNullValue(of(builder_->getInt1Ty())), builder_}; }
  IrNumber fma(IrNumber a, IrNumber b, IrNumber c) const {
    return made(builder_->CreateIntrinsic(llvm::Intrinsic::fma, {type()}, {a.value, b.value, c.value}));
  }
  IrNumber size(IrNumber a) const { return made(builder_->CreateUnaryIntrinsic(llvm::Intrinsic::fabs, a.value)); }
  IrNumber root(IrNumber a) const { return made(builder_->CreateUnaryIntrinsic(llvm::Intrinsic::sqrt, a.value)); }
  IrBits bits(IrNumber a) const { return {builder_->CreateBitCast(a.value, bits_type()), builder_}; }
  IrNumber number_of(IrBits b) const { return made(builder_->CreateBitCast(b.value, type())); }
  IrNumber select(IrTruth truth, IrNumber a, IrNumber b) const {
    return made(builder_->CreateSelect(truth.value, a.value, b.value));
  }
  IrTruth is_set(IrBits b) const { return {builder_->CreateICmpNE(b.value, integer(0).value), builder_}; }
  IrTruth is_unset(IrBits b) const { return {builder_->CreateICmpEQ(b.value, integer(0).value), builder_}; }
  IrTruth less(IrNumber a, IrNumber b) const { return {builder_->CreateFCmpOLT(a.value, b.value), builder_}; }
  IrTruth beyond(IrNumber a, IrNumber b) const { return {builder_->CreateFCmpUGT(a.value, b.value), builder_}; }
  Wide wide() const { return {*builder_, count_}; }
  IrNumber widen(IrNumber a) const { return made(builder_->CreateFPExt(a.value, wide().type())); }
  IrNumber narrow(IrNumber a) const { return made(builder_->CreateFPTrunc(a.value, type())); }

 private:
  llvm::Type* of(llvm::Type* scalar) const { return count_ == 1 ? scalar : llvm::FixedVectorType::get(scalar, count_); }
  llvm::Type* bits_type() const { return of(builder_->getIntNTy(8 * sizeof(T))); }
  IrNumber made(llvm::Value* value) const { return {value, builder_}; }

  llvm::IRBuilder<>* builder_;
  unsigned count_;
};

}  // namespace dpde::codegen
