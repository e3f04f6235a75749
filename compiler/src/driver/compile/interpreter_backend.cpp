// SPDX-License-Identifier: Apache-2.0
// Copies fields with ghost cells into the interpreter's state, runs the program, and copies the results back.
#include "driver/compile/interpreter_backend.h"

#include <algorithm>
#include <vector>

#include "stencil/build.h"
#include "stencil/interpret/interpret.h"
#include "support/assert.h"

namespace dpde::driver {

namespace {

/// Everything a program needs except the fields.
struct Context {
  const stencil::Module* module;
  const stencil::Program* program;
  const loop::Program* table;  // order of fields and sums
  const std::vector<std::string>* params;
  stencil::Interface interface;
  int halo;
  Precision real;
};

using stencil::CellIndex;

/// Calls `f(cell, element)` for the interior cells of the layout, extended by `grow` along each axis.
template <class F>
void for_each_cell(const dpde_layout& layout, const std::array<int, stencil::max_rank>& grow, const F& f) {
  for (int z = -grow[2]; z < layout.cells[2] + grow[2]; ++z) {
    for (int y = -grow[1]; y < layout.cells[1] + grow[1]; ++y) {
      for (int x = -grow[0]; x < layout.cells[0] + grow[0]; ++x)
        f(CellIndex{x, y, z}, x + y * layout.stride[1] + z * layout.stride[2]);
    }
  }
}

/// Networks in the order of the program's table.
std::vector<const network::Network*> networks_of(const Context& context) {
  std::vector<const network::Network*> networks;
  for (const std::string& name : context.interface.networks) networks.push_back(context.module->find_network(name));
  return networks;
}

void set_weights(const Context& context, const dpde_weights* weights, stencil::State& state) {
  for (const network::Network* network : networks_of(context)) {
    const dpde_weights& given = *weights++;
    stencil::Weights& own = state.weights[network->name];
    const std::int64_t count = weight_count(*network);
    own.values.assign(given.values, given.values + count);
    if (given.rates) own.rates.assign(given.rates, given.rates + count);
    if (given.host == nullptr) continue;
    const dpde_host_network host = *given.host;
    own.host_value = [host](const double* inputs, const double* w, double* outputs) {
      host.value(host.context, inputs, w, outputs);
    };
    own.host_vector_jacobian = [host](const double* inputs, const double* w, const double* seeds, double* input_bars,
                                      double* weight_bars) {
      host.vector_jacobian(host.context, inputs, w, seeds, input_bars, weight_bars);
    };
  }
}

void add_weight_bars(const Context& context, const stencil::State& state, const dpde_weights* weights) {
  for (const network::Network* network : networks_of(context)) {
    const dpde_weights& to = *weights++;
    const stencil::Weights& own = state.weights.at(network->name);
    for (std::size_t i = 0; to.bars && i < own.bars.size(); ++i) to.bars[i] += own.bars[i];
    for (std::size_t i = 0; to.rate_bars && i < own.rate_bars.size(); ++i) to.rate_bars[i] += own.rate_bars[i];
  }
}

template <class Real>
void run_program(void* opaque, const dpde_layout* layout, void* const* fields, const double* params,
                 const dpde_weights* weights, double* sums) {
  const Context& context = *static_cast<const Context*>(opaque);
  stencil::Grid grid{layout->rank, {1, 1, 1}};
  std::array<int, stencil::max_rank> grow{};
  for (int a = 0; a < layout->rank; ++a) {
    grid.cells[a] = static_cast<int>(layout->cells[a]);
    grow[a] = std::min<int>(context.halo, static_cast<int>(layout->halo[a]));
  }
  stencil::State state(grid, context.halo, context.real);
  const std::vector<std::string>& names = context.table->fields;
  for (const std::string& input : context.interface.inputs) {
    const auto number = std::find(names.begin(), names.end(), input) - names.begin();
    for_each_cell(*layout, grow, [&](const CellIndex& c, std::int64_t i) {
      state.at(input, c) = static_cast<const Real*>(fields[number])[i];
    });
  }
  stencil::Params values;
  for (std::size_t p = 0; p < context.params->size(); ++p) values[(*context.params)[p]] = params[p];
  set_weights(context, weights, state);
  const std::map<std::string, double> totals = stencil::interpret(*context.module, *context.program, state, values);
  for (std::size_t f = 0; f < names.size(); ++f) {
    // The interpreter has applied the swaps: the new value is stored under the state's name.
    std::string name = names[f];
    for (const stencil::Swap& swap : context.program->swaps) {
      if (swap.next == names[f]) name = swap.state;
    }
    const bool is_result = name != names[f] || std::find(context.program->keeps.begin(), context.program->keeps.end(),
                                                         name) != context.program->keeps.end();
    if (!is_result || !state.has(name)) continue;
    for_each_cell(*layout, {}, [&](const CellIndex& c, std::int64_t i) {
      static_cast<Real*>(fields[f])[i] = static_cast<Real>(state.at(name, c));
    });
  }
  add_weight_bars(context, state, weights);
  for (std::size_t s = 0; s < context.table->sums.size(); ++s) {
    const auto total = totals.find(context.table->sums[s]);
    sums[s] = total == totals.end() ? 0 : total->second;
  }
}

class InterpretedModule : public codegen::CompiledModule {
 public:
  InterpretedModule(const stencil::Module& stencil, const loop::Module& loop)
      : CompiledModule(codegen::ProgramTables(loop, {}, nullptr)), stencil_(stencil), loop_(loop) {
    for (const loop::Program& table : loop_.programs) {
      const stencil::Program* program = stencil_.find_program(table.name);
      require(program != nullptr, "a loop program without its stencil program");
      auto context = std::make_unique<Context>();
      *context = {&stencil_, program, &table, &loop_.params, stencil::interface_of(stencil_, *program), 0, loop_.real};
      for (const int halo : table.halo) context->halo = std::max(context->halo, halo);
      for (const auto& [field, halo] : stencil::required_halo(stencil_, *program)) {
        context->halo = std::max(context->halo, *std::max_element(halo.begin(), halo.end()));
      }
      const codegen::Interpret run = loop_.real == Precision::f32 ? run_program<float> : run_program<double>;
      tables().set_interpreter(table.name, run, context.get());
      contexts_.push_back(std::move(context));
    }
  }

 private:
  stencil::Module stencil_;
  loop::Module loop_;
  std::vector<std::unique_ptr<Context>> contexts_;
};

}  // namespace

std::shared_ptr<codegen::CompiledModule> interpreted(const stencil::Module& stencil, const loop::Module& loop) {
  return std::make_shared<InterpretedModule>(stencil, loop);
}

}  // namespace dpde::driver
