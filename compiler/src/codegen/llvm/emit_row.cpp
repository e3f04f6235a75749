// SPDX-License-Identifier: Apache-2.0
// A row becomes two functions: <row>_cells, with one noalias pointer for each line of memory it accesses, and the ABI
// function that takes those pointers from dpde_row. The loop has the form that the vectoriser expects: rotated, with
// its own preheader and exit, and no dependence between neighbours along x.
#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "codegen/llvm/emit_expr.h"
#include "codegen/llvm/emit_module.h"
#include "codegen/llvm/line_loads.h"
#include "codegen/llvm/optimise.h"
#include "dpde/kernel_abi.h"
#include "loop/expressions.h"
#include "support/assert.h"

namespace dpde::codegen {

namespace {

/// Largest number of arguments for which <row>_cells is inlined. Above, a call is cheap compared with the row, and
/// scheduling of inlined code takes quadratic time.
constexpr std::size_t most_inlined = 100;

/// Cells for which scatters are computed together; their targets and values fit in the L1 cache.
constexpr uint64_t strip_cells = 64;

/// Strips are used up to this number of scatter targets for a cell. With 64 (cubic, 3-D), strips take twice as long.
constexpr int most_places = 8;

/// Streams that differ only in the offset along x share one pointer; neighbours are at constant distances.
struct Line {
  int stream;  // the first one, whose pointer is passed
  bool is_read = false, is_written = false;
  bool is_over = false;  // may share memory with another line, cell by cell
};

class RowEmitter {
 public:
  RowEmitter(const loop::Module& module, const loop::Row& row, llvm::Module& out, const RowVariant& variant)
      : module_(module),
        row_(row),
        out_(out),
        variant_(variant),
        before_(out.getContext()),
        body_(out.getContext()),
        real_(module.real == Precision::f32 ? before_.getFloatTy() : before_.getDoubleTy()) {
    llvm::FastMathFlags flags;
    flags.setAllowContract();
    before_.setFastMathFlags(flags);
    body_.setFastMathFlags(flags);
    find_lines();
    find_uses();
  }
  void emit();

 private:
  /// Arguments of <row>_cells in order. `source`: where the wrapper finds the value.
  enum class Source { count, first, y, z, layout, uniforms, own, sums, line, grid };
  struct Argument {
    Source source;
    int index;  // of lines and grids
    std::string name;
  };

  void find_lines();
  void find_uses();
  void note_uses(const loop::Expr& expr, std::set<const loop::Node*>& seen);
  std::vector<Argument> arguments() const;
  llvm::Type* type_of(const Argument& argument);
  bool is_leading(int stream) const;
  void set_attributes(llvm::Argument* target, const Argument& argument);
  llvm::Function* create_function(const std::string& name, llvm::GlobalValue::LinkageTypes linkage,
                                  const std::vector<llvm::Type*>& types);
  void create_cells(const std::vector<Argument>& arguments);
  void emit_cells(const std::vector<Argument>& arguments);
  void emit_each_cell(llvm::Value* count);
  void emit_strips(llvm::Value* count);
  llvm::BasicBlock* block(const char* name) { return llvm::BasicBlock::Create(out_.getContext(), name, cells_); }
  template <class Each>
  void emit_loop(llvm::Value* count, const Each& each);
  void emit_adds(llvm::Value* count, const std::vector<std::array<llvm::AllocaInst*, 2>>& kept);
  void add_share(std::size_t scatter, llvm::Value* element, llvm::Value* value);
  void emit_totals(llvm::BasicBlock* cell);
  void emit_wrapper(const std::vector<Argument>& arguments);
  llvm::Value* member(std::size_t offset, llvm::Type* type, llvm::Value* row, const std::string& name);
  void load_uniforms();
  void emit_body();
  void emit_stores(ExprEmitter& emitter);
  llvm::Value* stream_pointer(int stream);
  llvm::Align alignment() const { return llvm::Align(bytes_of(module_.real)); }

  const loop::Module& module_;
  const loop::Row& row_;
  llvm::Module& out_;
  const RowVariant& variant_;
  llvm::IRBuilder<> before_, body_;
  llvm::Type* real_;  // type of fields and row values; uniforms and sums are doubles
  std::vector<Line> lines_;
  std::vector<int> line_of_stream_;
  std::vector<bool> used_uniforms_, scattered_grids_;
  bool needs_place_ = false;

  llvm::Function* cells_ = nullptr;
  std::map<Source, llvm::Value*> value_;
  std::vector<llvm::Value*> line_pointers_;
  PlaceEmitter::Row place_;
  llvm::Value* index_ = nullptr;  // number of the cell in the row
  Leaves leaves_;
  std::vector<llvm::Value*> totals_;
  std::vector<std::vector<PlaceEmitter::Share>> shares_;  // for each scatter
};

void RowEmitter::find_lines() {
  std::map<std::tuple<std::string, int, int>, int> known;
  for (std::size_t s = 0; s < row_.streams.size(); ++s) {
    const loop::Stream& stream = row_.streams[s];
    const auto [entry, is_new] = known.try_emplace({stream.field, stream.offset[1], stream.offset[2]}, lines_.size());
    if (is_new) lines_.push_back({static_cast<int>(s)});
    lines_[entry->second].is_read |= stream.mode != loop::Stream::Mode::out;
    lines_[entry->second].is_written |= stream.mode != loop::Stream::Mode::in;
    line_of_stream_.push_back(entry->second);
  }
  for (std::size_t s = 0; s < row_.streams.size(); ++s) {
    if (row_.streams[s].over < 0) continue;
    for (const std::size_t one : {s, static_cast<std::size_t>(row_.streams[s].over)})
      lines_[line_of_stream_[one]].is_over = true;
  }
}

void RowEmitter::find_uses() {
  used_uniforms_.resize(module_.uniforms.size());
  scattered_grids_.resize(row_.grids.size());
  needs_place_ = !row_.scatters.empty();
  for (const loop::Scatter& scatter : row_.scatters) scattered_grids_.at(scatter.target.grid) = true;
  std::set<const loop::Node*> seen;
  for_each_expression(row_, [&](const loop::Expr& expr) { note_uses(expr, seen); });
}

void RowEmitter::note_uses(const loop::Expr& expr, std::set<const loop::Node*>& seen) {
  if (!seen.insert(&expr.node()).second) return;  // expressions may share nodes
  if (const auto* uniform = as<loop::Uniform>(expr)) used_uniforms_.at(uniform->index) = true;
  needs_place_ |= is<loop::Inside>(expr);
  needs_place_ |= is<loop::Interp>(expr);
  for_each_child(expr, [&](const loop::Expr& child) { note_uses(child, seen); });
}

std::vector<RowEmitter::Argument> RowEmitter::arguments() const {
  std::vector<Argument> result{{Source::count, 0, "count"}};
  if (needs_place_) {
    result.insert(result.end(), {{Source::first, 0, "first"}, {Source::y, 0, "y"}, {Source::z, 0, "z"}});
    result.push_back({Source::layout, 0, "layout"});
  }
  result.push_back({Source::uniforms, 0, "uniforms"});
  if (row_.row_constant_count > 0) result.push_back({Source::own, 0, "own"});
  if (!row_.sums.empty()) result.push_back({Source::sums, 0, "sums"});
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    result.push_back({Source::line, static_cast<int>(i), line_name(row_.streams.at(lines_[i].stream))});
  }
  for (std::size_t i = 0; i < row_.grids.size(); ++i) {
    result.push_back({Source::grid, static_cast<int>(i), row_.grids[i] + "_grid"});
  }
  return result;
}

llvm::Type* RowEmitter::type_of(const Argument& argument) {
  switch (argument.source) {
    case Source::count:
    case Source::first:
    case Source::y:
    case Source::z: return before_.getInt64Ty();
    case Source::layout:
    case Source::uniforms:
    case Source::own:
    case Source::sums:
    case Source::line:
    case Source::grid: return before_.getPtrTy();
  }
  unreachable("source of an argument");
}

/// Whether the line is the last one of its field in memory.
bool RowEmitter::is_leading(int stream) const {
  const auto place = [](const loop::Stream& one) { return std::pair(one.offset[2], one.offset[1]); };
  const loop::Stream& line = row_.streams.at(stream);
  return std::ranges::none_of(
      row_.streams, [&](const loop::Stream& other) { return other.field == line.field && place(other) > place(line); });
}

/// Pointers of one row do not alias, unless both only read or one stream overwrites the other.
void RowEmitter::set_attributes(llvm::Argument* target, const Argument& argument) {
  target->setName(argument.name);
  if (!target->getType()->isPointerTy()) return;
  bool is_read = true, is_written = false, is_over = false;
  if (argument.source == Source::sums) is_written = true;
  if (argument.source == Source::grid) is_written = scattered_grids_.at(argument.index);
  if (argument.source == Source::line) {
    is_read = lines_.at(argument.index).is_read;
    is_written = lines_.at(argument.index).is_written;
    is_over = lines_.at(argument.index).is_over;
    const int stream = lines_.at(argument.index).stream;
    const std::string start = std::to_string(row_.streams.at(stream).offset[0]);
    if (!is_written) target->addAttr(llvm::Attribute::get(out_.getContext(), line_start_attribute, start));
    if (variant_.ahead && is_read && is_leading(stream))
      target->addAttr(llvm::Attribute::get(out_.getContext(), leading_attribute));
  }
  if (!is_over) target->addAttr(llvm::Attribute::NoAlias);
  target->addAttr(llvm::Attribute::NoCapture);
  if (!is_written) target->addAttr(llvm::Attribute::ReadOnly);
  if (!is_read) target->addAttr(llvm::Attribute::WriteOnly);
}

llvm::Function* RowEmitter::create_function(const std::string& name, llvm::GlobalValue::LinkageTypes linkage,
                                            const std::vector<llvm::Type*>& types) {
  auto* type = llvm::FunctionType::get(before_.getVoidTy(), types, false);
  auto* function = llvm::Function::Create(type, linkage, name, out_);
  function->setDoesNotThrow();
  if (variant_.vector_width > 0) function->addFnAttr("prefer-vector-width", std::to_string(variant_.vector_width));
  if (variant_.streams) function->addFnAttr(streaming_attribute);
  return function;
}

void RowEmitter::emit() {
  const std::vector<Argument> list = arguments();
  emit_cells(list);
  emit_wrapper(list);
}

llvm::Value* RowEmitter::member(std::size_t offset, llvm::Type* type, llvm::Value* row, const std::string& name) {
  llvm::Value* address = before_.CreateConstInBoundsGEP1_64(before_.getInt8Ty(), row, offset);
  return before_.CreateAlignedLoad(type, address, llvm::Align(8), name);
}

void RowEmitter::emit_wrapper(const std::vector<Argument>& arguments) {
  llvm::Function* function =
      create_function(row_symbol(row_.name) + variant_.suffix, llvm::Function::ExternalLinkage, {before_.getPtrTy()});
  llvm::Value* row = function->getArg(0);
  row->setName("row");
  before_.SetInsertPoint(llvm::BasicBlock::Create(out_.getContext(), "entry", function));
  const auto direct = [&](const Argument& argument, std::size_t offset) {
    return member(offset, type_of(argument), row, argument.name);
  };
  std::map<std::size_t, llvm::Value*> arrays;
  const auto element = [&](const Argument& argument, std::size_t offset, int index) {
    llvm::Value*& array = arrays[offset];
    if (array == nullptr) array = member(offset, before_.getPtrTy(), row, "");
    return member(index * sizeof(void*), before_.getPtrTy(), array, argument.name);
  };
  std::vector<llvm::Value*> values;
  for (const Argument& argument : arguments) {
    switch (argument.source) {
      case Source::count: values.push_back(direct(argument, offsetof(dpde_row, count))); break;
      case Source::first: values.push_back(direct(argument, offsetof(dpde_row, first))); break;
      case Source::y: values.push_back(direct(argument, offsetof(dpde_row, y))); break;
      case Source::z: values.push_back(direct(argument, offsetof(dpde_row, z))); break;
      case Source::layout: values.push_back(direct(argument, offsetof(dpde_row, layout))); break;
      case Source::uniforms: values.push_back(direct(argument, offsetof(dpde_row, uniforms))); break;
      case Source::own: values.push_back(direct(argument, offsetof(dpde_row, own))); break;
      case Source::sums: values.push_back(direct(argument, offsetof(dpde_row, sums))); break;
      case Source::grid: values.push_back(element(argument, offsetof(dpde_row, grids), argument.index)); break;
      case Source::line:
        values.push_back(element(argument, offsetof(dpde_row, streams), lines_.at(argument.index).stream));
        break;
    }
  }
  before_.CreateCall(cells_, values);
  before_.CreateRetVoid();
}

void RowEmitter::load_uniforms() {
  leaves_.uniforms.resize(module_.uniforms.size());
  for (std::size_t i = 0; i < module_.uniforms.size(); ++i) {
    if (!used_uniforms_[i]) continue;
    const bool is_own = row_.is_own(static_cast<int>(i));
    llvm::Value* uniform =
        member((is_own ? i - static_cast<std::size_t>(row_.own) : i) * sizeof(double), before_.getDoubleTy(),
               value_.at(is_own ? Source::own : Source::uniforms), module_.uniforms[i].name);
    leaves_.uniforms[i] = before_.CreateFPCast(uniform, real_);
  }
}

/// Creates the function with its arguments, without code.
void RowEmitter::create_cells(const std::vector<Argument>& arguments) {
  std::vector<llvm::Type*> types;
  for (const Argument& argument : arguments) types.push_back(type_of(argument));
  cells_ = create_function(row_symbol(row_.name) + variant_.suffix + "_cells", llvm::Function::InternalLinkage, types);
  // Inlining drops the noalias of arguments; the scheduler then orders every load after every earlier store.
  cells_->addFnAttr(arguments.size() <= most_inlined ? llvm::Attribute::AlwaysInline : llvm::Attribute::NoInline);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    llvm::Argument* value = cells_->getArg(i);
    set_attributes(value, arguments[i]);
    if (arguments[i].source == Source::line) line_pointers_.push_back(value);
    if (arguments[i].source == Source::grid) place_.grids.push_back(value);
    value_[arguments[i].source] = value;
  }
  if (!needs_place_) return;
  place_.first = value_.at(Source::first);
  place_.y = value_.at(Source::y);
  place_.z = value_.at(Source::z);
  place_.layout = value_.at(Source::layout);
}

/// Block `before` has the loop-invariant code. The code for the cells follows; `body_` is then at its end.
void RowEmitter::emit_cells(const std::vector<Argument>& arguments) {
  create_cells(arguments);
  before_.SetInsertPoint(block("entry"));
  llvm::BasicBlock* before = block("before");
  llvm::BasicBlock* done = llvm::BasicBlock::Create(out_.getContext(), "done");
  llvm::Value* count = value_.at(Source::count);
  before_.CreateCondBr(before_.CreateICmpSGT(count, before_.getInt64(0)), before, done);
  before_.SetInsertPoint(before);
  load_uniforms();
  const int places = places_of_scatters(row_);
  places > 0 && places <= most_places ? emit_strips(count) : emit_each_cell(count);
  body_.CreateBr(done);
  done->insertInto(cells_);
  body_.SetInsertPoint(done);
  body_.CreateRetVoid();
}

/// Block `cell` is the loop; block `exit` stores the totals of the sums.
void RowEmitter::emit_each_cell(llvm::Value* count) {
  llvm::BasicBlock* cell = block("cell");
  llvm::BasicBlock* exit = block("exit");
  body_.SetInsertPoint(cell);
  llvm::PHINode* i = body_.CreatePHI(body_.getInt64Ty(), 2, "i");
  i->addIncoming(body_.getInt64(0), before_.GetInsertBlock());
  index_ = i;
  emit_body();
  for (std::size_t s = 0; s < shares_.size(); ++s) {
    for (const PlaceEmitter::Share& share : shares_[s]) add_share(s, share.element, share.value);
  }
  llvm::Value* next = body_.CreateAdd(i, body_.getInt64(1), "next", true, true);
  i->addIncoming(next, cell);
  llvm::BranchInst* again = body_.CreateCondBr(body_.CreateICmpEQ(next, count), exit, cell);
  if (std::ranges::any_of(lines_, &Line::is_over)) say_rounds_are_apart(*cell, *again);
  before_.CreateBr(cell);
  body_.SetInsertPoint(exit);
  emit_totals(cell);
}

/// Emits a loop that runs `each` for 0 .. count - 1 (count > 0) at `body_`, which is then after the loop.
template <class Each>
void RowEmitter::emit_loop(llvm::Value* count, const Each& each) {
  llvm::BasicBlock* from = body_.GetInsertBlock();
  llvm::BasicBlock* one = block("one");
  llvm::BasicBlock* behind = block("behind");
  body_.CreateBr(one);
  body_.SetInsertPoint(one);
  llvm::PHINode* k = body_.CreatePHI(body_.getInt64Ty(), 2, "k");
  k->addIncoming(body_.getInt64(0), from);
  each(k);
  llvm::Value* next = body_.CreateAdd(k, body_.getInt64(1), "next", true, true);
  k->addIncoming(next, one);
  body_.CreateCondBr(body_.CreateICmpEQ(next, count), behind, one);
  body_.SetInsertPoint(behind);
}

/// Scatters in strips of cells: a vectorisable loop computes targets and values, then one loop for each target corner
/// adds them. Without strips all of it is scalar (gradient of bench_traced: 34 us; with strips 30).
void RowEmitter::emit_strips(llvm::Value* count) {
  llvm::BasicBlock* strip = block("strip");
  body_.SetInsertPoint(strip);
  llvm::PHINode* first = body_.CreatePHI(body_.getInt64Ty(), 2, "strip_first");
  first->addIncoming(body_.getInt64(0), before_.GetInsertBlock());
  llvm::Value* size =
      body_.CreateBinaryIntrinsic(llvm::Intrinsic::umin, body_.CreateSub(count, first), body_.getInt64(strip_cells));
  std::vector<std::array<llvm::AllocaInst*, 2>> kept;  // for each share: elements and values
  llvm::IRBuilder<> stack(&cells_->getEntryBlock(), cells_->getEntryBlock().begin());
  const auto keep = [&](llvm::Value* value, llvm::Value* k) {
    llvm::AllocaInst* array = stack.CreateAlloca(value->getType(), stack.getInt64(strip_cells));
    array->setAlignment(llvm::Align(cache_line));
    body_.CreateStore(value, body_.CreateInBoundsGEP(value->getType(), array, k));
    return array;
  };
  emit_loop(size, [&](llvm::Value* k) {
    index_ = body_.CreateNSWAdd(first, k);
    emit_body();
    for (const std::vector<PlaceEmitter::Share>& of_scatter : shares_) {
      for (const PlaceEmitter::Share& share : of_scatter)
        kept.push_back({keep(share.element, k), keep(share.value, k)});
    }
  });
  emit_adds(size, kept);
  llvm::Value* next = body_.CreateNUWAdd(first, body_.getInt64(strip_cells));
  first->addIncoming(next, body_.GetInsertBlock());
  llvm::BasicBlock* exit = block("exit");
  body_.CreateCondBr(body_.CreateICmpULT(next, count), strip, exit);
  before_.CreateBr(strip);
  body_.SetInsertPoint(exit);
}

void RowEmitter::emit_adds(llvm::Value* count, const std::vector<std::array<llvm::AllocaInst*, 2>>& kept) {
  auto next = kept.begin();
  for (std::size_t s = 0; s < shares_.size(); ++s) {
    for (std::size_t share = 0; share < shares_[s].size(); ++share, ++next) {
      emit_loop(count, [&](llvm::Value* k) {
        const auto value_of = [&](llvm::AllocaInst* array) {
          llvm::Type* type = array->getAllocatedType();
          return body_.CreateLoad(type, body_.CreateInBoundsGEP(type, array, k));
        };
        add_share(s, value_of((*next)[0]), value_of((*next)[1]));
      });
    }
  }
}

void RowEmitter::add_share(std::size_t scatter, llvm::Value* element, llvm::Value* value) {
  llvm::Value* grid = place_.grids.at(static_cast<std::size_t>(row_.scatters[scatter].target.grid));
  llvm::Value* address = body_.CreateInBoundsGEP(real_, grid, element);
  llvm::Value* old = body_.CreateAlignedLoad(real_, address, alignment());
  body_.CreateAlignedStore(body_.CreateFAdd(old, value), address, alignment());
}

void RowEmitter::emit_totals(llvm::BasicBlock* cell) {
  for (std::size_t s = 0; s < totals_.size(); ++s) {
    auto* total = body_.CreatePHI(body_.getDoubleTy(), 1, row_.sums[s].name + "_row");
    total->addIncoming(totals_[s], cell);
    totals_[s] = total;
  }
  for (std::size_t s = 0; s < totals_.size(); ++s) {
    llvm::Value* address = body_.CreateConstInBoundsGEP1_64(body_.getDoubleTy(), value_.at(Source::sums), s);
    llvm::Value* old = body_.CreateAlignedLoad(body_.getDoubleTy(), address, llvm::Align(8));
    body_.CreateAlignedStore(body_.CreateFAdd(old, totals_[s]), address, llvm::Align(8));
  }
}

llvm::Value* RowEmitter::stream_pointer(int stream) {
  const int line = line_of_stream_.at(stream);
  const int distance = row_.streams.at(stream).offset[0] - row_.streams.at(lines_.at(line).stream).offset[0];
  llvm::Value* element = distance == 0 ? index_ : body_.CreateNSWAdd(index_, body_.getInt64(distance));
  return body_.CreateInBoundsGEP(real_, line_pointers_.at(line), element);
}

void RowEmitter::emit_body() {
  std::vector<llvm::PHINode*> accumulators;
  for (const loop::Sum& sum : row_.sums) {
    auto* accumulator = body_.CreatePHI(body_.getDoubleTy(), 2, sum.name);
    accumulator->addIncoming(llvm::ConstantFP::get(body_.getDoubleTy(), 0.0), before_.GetInsertBlock());
    accumulators.push_back(accumulator);
  }
  for (std::size_t s = 0; s < row_.streams.size(); ++s) {
    const bool is_read = row_.streams[s].mode != loop::Stream::Mode::out;
    if (row_.streams[s].is_even)
      leaves_.loads.push_back(before_.CreateAlignedLoad(real_, line_pointers_.at(line_of_stream_.at(s)), alignment()));
    else
      leaves_.loads.push_back(is_read ? body_.CreateAlignedLoad(real_, stream_pointer(s), alignment()) : nullptr);
  }
  PlaceEmitter place(row_, place_, real_, before_, body_, index_);
  ExprEmitter emitter(body_, leaves_, real_, &place);
  for (const loop::Let& let : row_.lets) {
    leaves_.lets.push_back(emitter.value(let.value));
    if (llvm::isa<llvm::Instruction>(leaves_.lets.back())) leaves_.lets.back()->setName(let.name);
  }
  emit_stores(emitter);
  for (std::size_t s = 0; s < row_.sums.size(); ++s) {
    llvm::Value* value = body_.CreateFPCast(emitter.number(row_.sums[s].value), body_.getDoubleTy());
    auto* total = llvm::cast<llvm::Instruction>(body_.CreateFAdd(accumulators[s], value));
    total->setHasAllowReassoc(true);  // needed to vectorise sums
    accumulators[s]->addIncoming(total, body_.GetInsertBlock());
    totals_.push_back(total);
  }
  for (const loop::Scatter& scatter : row_.scatters) {
    const std::vector<llvm::Value*> displacement = emitter.numbers(scatter.target.displacement);
    shares_.push_back(place.scatter(scatter.target, displacement, emitter.number(scatter.value)));
  }
}

/// A stream may be stored to several times; all reads see the value before the first store.
void RowEmitter::emit_stores(ExprEmitter& emitter) {
  std::map<int, llvm::Value*> stored;
  for (const loop::Store& store : row_.stores) {
    llvm::Value* value = emitter.number(store.value);
    if (store.accumulate) {
      const auto earlier = stored.find(store.stream);
      llvm::Value* old = earlier != stored.end() ? earlier->second : leaves_.loads.at(store.stream);
      value = body_.CreateFAdd(old, value);
    }
    stored[store.stream] = value;
  }
  for (const auto& [stream, value] : stored) {
    body_.CreateAlignedStore(value, stream_pointer(stream), alignment());
  }
}

}  // namespace

void emit_row(const loop::Module& module, const loop::Row& row, llvm::Module& out, const RowVariant& variant) {
  RowEmitter(module, row, out, variant).emit();
}

}  // namespace dpde::codegen
