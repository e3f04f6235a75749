// SPDX-License-Identifier: Apache-2.0
// Every rule of verify_loop, broken once in a module that is otherwise right.
#include "loop/verify_loop.h"

#include <gtest/gtest.h>

#include <functional>

#include "loop/expressions.h"
#include "loop/from_stencil.h"
#include "loop/loop_samples.h"

namespace dpde {
namespace {

using Errors = std::vector<std::string>;

Errors after(const std::function<void(loop::Module&)>& damage) {
  loop::Module module = loop::from_stencil(samples::burgers(), {"burgers_step"});
  EXPECT_EQ(loop::verify(module), Errors{});
  damage(module);
  return loop::verify(module);
}

loop::Row& row(loop::Module& module) { return module.rows.at(0); }
loop::Program& program(loop::Module& module) { return module.programs.at(0); }

TEST(VerifyLoop, Indices) {
  EXPECT_EQ(after([](loop::Module& m) { row(m).stores[0].value = loop::make(loop::Load{9}); }),
            Errors{"burgers_step: no such stream"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).stores[0].value = loop::make(loop::Uniform{3}); }),
            Errors{"burgers_step: no such uniform"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).lets[0].value = loop::make(loop::Local{0}); }),
            Errors{"burgers_step: reads a let that is not defined before it"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).stores[0].stream = -1; }), Errors{"burgers_step: no such stream"});
  EXPECT_EQ(after([](loop::Module& m) {
              row(m).lets[0].value = loop::make(loop::Interp{0, {}, {}, {}});
            }),
            (Errors{"burgers_step: no such grid", "burgers_step: a displacement needs one value an axis"}));
}

TEST(VerifyLoop, Uniforms) {
  EXPECT_EQ(after([](loop::Module& m) { m.uniforms[0].value = loop::make(loop::Uniform{1}); }),
            Errors{"u0: reads a uniform that is not defined before it"});
  EXPECT_EQ(after([](loop::Module& m) { m.uniforms[0].value = loop::make(loop::Load{1}); }),
            Errors{"u0: a uniform reads what differs from point to point"});
  EXPECT_EQ(after([](loop::Module& m) { m.uniforms[0].value = loop::make(loop::Param{7}); }),
            Errors{"u0: no such parameter"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).lets[0].value = loop::make(loop::Param{0}); }),
            Errors{"burgers_step: a parameter outside the definition of a uniform"});
}

TEST(VerifyLoop, Modes) {
  EXPECT_EQ(after([](loop::Module& m) { row(m).lets[0].value = loop::make(loop::Load{0}); }),
            Errors{"burgers_step: reads a stream that is only written"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).stores[0].accumulate = true; }),
            Errors{"burgers_step: adds to a stream that is only written"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).streams[0].offset = {1}; }),
            Errors{"burgers_step: writes u_next at an offset"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).streams[2].field = "u_next"; }),
            Errors{"burgers_step: writes u_next and has another stream of it"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).grids = {"u_next"}; }),
            Errors{"burgers_step: writes u_next and reads it at computed places"});
  EXPECT_EQ(after([](loop::Module& m) { row(m).stores[0].stream = 1; }),
            Errors{"burgers_step: stores to a stream that is only read"});
}

TEST(VerifyLoop, Scatters) {
  const auto scatter = [](loop::Module& m) {
    row(m).grids = {"s"};
    program(m).fields.push_back("s");
    row(m).stores.clear();
    row(m).streams[0].mode = loop::Stream::Mode::in;
    std::get<loop::Sweep>(program(m).body[0]).then.clear();
    row(m).scatters = {{{0, {}, {0.0}, {}}, loop::make(loop::Load{1})}};
  };
  EXPECT_EQ(after(scatter), Errors{"burgers_step: burgers_step: scatters run serially"});
  const auto serial = [&](loop::Module& m) {
    scatter(m);
    std::get<loop::Sweep>(program(m).body[0]).serial = true;
  };
  EXPECT_EQ(after(serial), Errors{});
  EXPECT_EQ(after([&](loop::Module& m) {
              serial(m);
              row(m).scatters[0].value = loop::make(loop::Interp{0, {}, {0.0}, {}});
            }),
            Errors{"burgers_step: reads s while scattering to it"});
}

TEST(VerifyLoop, Programs) {
  EXPECT_EQ(after([](loop::Module& m) { program(m).fields = {"u"}; }),
            (Errors{"burgers_step: no field u_next", "burgers_step: no field u_next",
                    "burgers_step: swaps a field it does not have"}));
  EXPECT_EQ(after([](loop::Module& m) { program(m).prepare[0].axes.clear(); }),
            Errors{"burgers_step: u needs one boundary an axis"});
  EXPECT_EQ(after([](loop::Module& m) { program(m).prepare[0].axes[0].topology = Topology::bounded; }),
            Errors{"burgers_step: boundary of u on another kind of axis"});
  EXPECT_EQ(after([](loop::Module& m) { std::get<loop::Sweep>(program(m).body[0]).row = "other"; }),
            Errors{"burgers_step: no row other"});
  EXPECT_EQ(after([](loop::Module& m) { std::get<loop::Sweep>(program(m).body[0]).then[0].field = "u"; }),
            Errors{"burgers_step: burgers_step fills u, which it does not write"});
  EXPECT_EQ(after([](loop::Module& m) { program(m).keeps = {"z9"}; }),
            Errors{"burgers_step: keeps z9, which it does not have"});
  const auto with_reduction = [](loop::Reduce reduce) {
    return after([&](loop::Module& m) { program(m).body.emplace_back(reduce); });
  };
  EXPECT_EQ(with_reduction({"u_next", Reduction::max, "u", {true}}), Errors{});
  EXPECT_EQ(with_reduction({"m", Reduction::max, "u", {true}}), Errors{"burgers_step: no field m"});
  EXPECT_EQ(with_reduction({"u", Reduction::max, "u", {true}}), Errors{"burgers_step: reduces u to itself"});
  EXPECT_EQ(with_reduction({"u_next", Reduction::max, "u", {true, true}}),
            Errors{"burgers_step: reduces along an axis it does not have"});
  EXPECT_EQ(after([](loop::Module& m) { m.rows.push_back(m.rows[0]); }), Errors{"burgers_step: two rows of this name"});
}

}  // namespace
}  // namespace dpde
