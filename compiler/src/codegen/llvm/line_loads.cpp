// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/line_loads.h"

#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Analysis/ScalarEvolution.h>
#include <llvm/Analysis/ScalarEvolutionExpressions.h>
#include <llvm/Analysis/ValueTracking.h>
#include <llvm/IR/Constants.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Instructions.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include "codegen/llvm/optimise.h"

namespace dpde::codegen {

namespace {

constexpr int64_t prefetch_distance = 2048;  // bytes

/// A vector load in a loop: its line, and the address in the first iteration, in bytes from the row's first cell.
struct LineLoad {
  llvm::LoadInst* load;
  llvm::Argument* line;
  int64_t place;
  int64_t step;  // bytes for each iteration
};

int64_t bytes_of(llvm::Type* type) { return static_cast<int64_t>(type->getPrimitiveSizeInBits().getFixedValue() / 8); }

/// Rounds down to a multiple of the cache line.
int64_t line_below(int64_t place) { return place - ((place % cache_line) + cache_line) % cache_line; }

/// Address of a line's pointer, in bytes from the first cell. nullopt for other pointers and for lines that are
/// written.
std::optional<int64_t> start_of(const llvm::Argument* line, int64_t value_bytes) {
  if (line == nullptr || !line->hasAttribute(llvm::Attribute::ReadOnly)) return std::nullopt;
  const llvm::Attribute start = line->getParent()->getAttributes().getParamAttr(line->getArgNo(), line_start_attribute);
  int64_t cells = 0;
  if (!start.isValid() || start.getValueAsString().getAsInteger(10, cells)) return std::nullopt;
  return cells * value_bytes;
}

std::optional<LineLoad> line_load(llvm::Instruction& instruction, const llvm::Loop& loop,
                                  llvm::ScalarEvolution& evolution) {
  auto* load = llvm::dyn_cast<llvm::LoadInst>(&instruction);
  if (load == nullptr || !load->isSimple() || !load->getType()->isVectorTy() || bytes_of(load->getType()) != cache_line)
    return std::nullopt;
  auto* line =
      const_cast<llvm::Argument*>(llvm::dyn_cast<llvm::Argument>(llvm::getUnderlyingObject(load->getPointerOperand())));
  const std::optional<int64_t> start = start_of(line, bytes_of(load->getType()->getScalarType()));
  const auto* pointer = llvm::dyn_cast<llvm::SCEVAddRecExpr>(evolution.getSCEV(load->getPointerOperand()));
  if (!start || pointer == nullptr || pointer->getLoop() != &loop || !pointer->isAffine()) return std::nullopt;
  const auto* step = llvm::dyn_cast<llvm::SCEVConstant>(pointer->getStepRecurrence(evolution));
  const auto* distance =
      llvm::dyn_cast<llvm::SCEVConstant>(evolution.getMinusSCEV(pointer->getStart(), evolution.getSCEV(line)));
  if (step == nullptr || distance == nullptr) return std::nullopt;
  return LineLoad{load, line, *start + distance->getAPInt().getSExtValue(), step->getAPInt().getSExtValue()};
}

/// All loads of one line in one loop.
class Carried {
 public:
  Carried(llvm::Loop& loop, std::vector<LineLoad> loads)
      : loop_(loop),
        loads_(std::move(loads)),
        type_(loads_.front().load->getType()),
        bits_(llvm::VectorType::getInteger(llvm::cast<llvm::VectorType>(type_))),
        step_(loads_.front().step) {
    for (const LineLoad& one : loads_) {
      needed_.insert(line_below(one.place));
      if (one.place % cache_line != 0) needed_.insert(line_below(one.place) + cache_line);
    }
  }

  /// Whether an iteration then loads fewer vectors than before.
  bool pays() const {
    const auto is_loaded = [&](int64_t place) { return !needed_.contains(place + step_); };
    const auto is_alike = [&](const LineLoad& one) { return one.load->getType() == type_ && one.step == step_; };
    return step_ % cache_line == 0 && std::ranges::all_of(loads_, is_alike) &&
           std::ranges::count_if(needed_, is_loaded) < std::ssize(loads_);
  }

  void replace() {
    for (auto place = needed_.rbegin(); place != needed_.rend();
         ++place) {  // from above: this iteration's line is the lower one of the next iteration
      const auto next = whole_.find(*place + step_);
      whole_[*place] = next == whole_.end() ? load_in_loop(*place) : carry(*place, next->second);
    }
    for (const LineLoad& one : loads_) {
      one.load->replaceAllUsesWith(shifted(one));
      one.load->eraseFromParent();
    }
  }

 private:
  llvm::Value* load_at(llvm::IRBuilder<>& builder, llvm::Value* from, int64_t bytes) {
    llvm::Value* pointer = bytes == 0 ? from : builder.CreateGEP(builder.getInt8Ty(), from, builder.getInt64(bytes));
    return builder.CreateAlignedLoad(bits_, pointer, loads_.front().load->getAlign());
  }

  llvm::Value* load_in_loop(int64_t place) {
    llvm::IRBuilder<> builder(loads_.front().load);
    return load_at(builder, loads_.front().load->getPointerOperand(), place - loads_.front().place);
  }

  llvm::Value* carry(int64_t place, llvm::Value* next) {
    llvm::IRBuilder<> before(loop_.getLoopPreheader()->getTerminator());
    llvm::BasicBlock* body = loop_.getHeader();
    const int64_t start = *start_of(loads_.front().line, bytes_of(type_->getScalarType()));
    auto* carried = llvm::PHINode::Create(bits_, 2, "", body->begin());
    carried->addIncoming(load_at(before, loads_.front().line, place - start), loop_.getLoopPreheader());
    carried->addIncoming(next, body);
    return carried;
  }

  llvm::Value* shifted(const LineLoad& one) {
    const int64_t below = line_below(one.place);
    if (below == one.place) return llvm::IRBuilder<>(one.load).CreateBitCast(whole_.at(below), type_);
    std::vector<int> lanes(static_cast<size_t>(cache_line / bytes_of(type_->getScalarType())));
    std::iota(lanes.begin(), lanes.end(), static_cast<int>((one.place - below) / bytes_of(type_->getScalarType())));
    llvm::IRBuilder<> builder(one.load);
    return builder.CreateBitCast(builder.CreateShuffleVector(whole_.at(below), whole_.at(below + cache_line), lanes),
                                 type_);
  }

  llvm::Loop& loop_;
  std::vector<LineLoad> loads_;  // the loads of the original loop
  llvm::Type* type_;
  llvm::Type* bits_;  // integers: LLVM 19 turns shuffles of floats into indexed permutations, which cost more than
                      // shifts
  int64_t step_;
  std::set<int64_t> needed_;               // offsets of whole cache lines
  std::map<int64_t, llvm::Value*> whole_;  // loaded vector of each offset
};

/// Prefetches every cache line of a leading line once.
bool prefetch(const LineLoad& first) {
  if (!first.line->getParent()->getAttributes().hasParamAttr(first.line->getArgNo(), leading_attribute)) return false;
  llvm::IRBuilder<> builder(first.load);
  for (int64_t byte = 0; byte < first.step; byte += cache_line) {
    llvm::Value* ahead = builder.CreateGEP(builder.getInt8Ty(), first.load->getPointerOperand(),
                                           builder.getInt64(prefetch_distance + byte));
    builder.CreateIntrinsic(llvm::Intrinsic::prefetch, {ahead->getType()},
                            {ahead, builder.getInt32(0), builder.getInt32(3), builder.getInt32(1)});
  }
  return true;
}

bool change_loads(llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  std::vector<llvm::Argument*> order;  // in order of first use, not of addresses: the same code on every run
  std::map<llvm::Argument*, std::vector<LineLoad>> lines;
  for (llvm::Instruction& instruction : *loop.getHeader()) {
    const std::optional<LineLoad> found = line_load(instruction, loop, evolution);
    if (!found) continue;
    if (lines[found->line].empty()) order.push_back(found->line);
    lines[found->line].push_back(*found);
  }
  bool is_changed = false;
  for (llvm::Argument* line : order) {
    is_changed |= prefetch(lines.at(line).front());
    Carried carried(loop, lines.at(line));
    if (!carried.pays()) continue;
    carried.replace();
    is_changed = true;
  }
  return is_changed;
}

}  // namespace

llvm::PreservedAnalyses LineLoads::run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses) {
  auto& evolution = analyses.getResult<llvm::ScalarEvolutionAnalysis>(function);
  bool is_changed = false;
  for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
    if (loop->getNumBlocks() == 1 && loop->getLoopPreheader() != nullptr) is_changed |= change_loads(*loop, evolution);
  }
  return is_changed ? llvm::PreservedAnalyses::none() : llvm::PreservedAnalyses::all();
}

}  // namespace dpde::codegen
