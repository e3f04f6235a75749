// SPDX-License-Identifier: Apache-2.0
// Text to stencil and back: print(from_ast(parse(t))) == t for canonical texts, and the same module again.
#include <gtest/gtest.h>

#include <random>

#include "stencil/analyse/verify_stencil.h"
#include "stencil_text.h"

namespace dpde::stencil {
namespace {

void expect_same_again(const std::string& text) {
  const Module m = module_of(text);
  EXPECT_EQ(print(m), text);
  EXPECT_EQ(verify(m), std::vector<std::string>{});
  EXPECT_TRUE(module_of(print(m)) == m);
}

TEST(Text, TheSketchOfTheLanguage) {
  const Module m = module_of(R"(
# the same language one level down
kernel burgers_step(u: field halo 1, out u_next: field, nu, hx, dt: param) {
  let ux = (u[+1] - u[-1]) / (2*hx)
  u_next = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/hx^2)
}
program wave_step {
  fill u periodic
  run burgers_step
  swap u, u_next
}
loop n in 0 .. 32 { wave_step }
)");
  EXPECT_EQ(print(m), R"(kernel burgers_step(u: field halo 1, out u_next: field, hx, dt, nu: param) {
  let ux = (u[+1] - u[-1])/(2*hx)
  u_next = u + dt*(nu*(u[-1] - 2*u + u[+1])/hx^2 - u*ux)
}

program wave_step {
  fill u periodic
  run burgers_step
  swap u, u_next
}

loop n in 0 .. 32 { wave_step }
)");
  expect_same_again(print(m));
}

TEST(Text, Transforms) {
  expect_same_again(R"(program p {
  axes x periodic, y periodic
  transform u by c*ikx^2 + iky^4 to w
  transform u by phi0(dt*(ikx^2 - c*iky)) within two_thirds, w by phi3(a)*(dt/2*ikx) to v
  transform u by phi10(a*ikx)*(ikx), w by phi19(a*iky), u by heaviside0(ikx^2 + iky^2 + 20)*(a*ikx) to q
  swap u, v
  keep q
}
)");
}

TEST(Text, AllKindsOfExpressions) {
  expect_same_again(
      R"(kernel k(u: field halo 2, v: field halo 1, out a: field, out b: field, out c: field, out d: field, q, p: param) {
  let inner = inside[-1, 0] and inside[0, +2] grow 1 or u < 1e-10
  a = if(inner, u[+1, 0]/2, -u[0, -2]*q)
  b = interp(v, p, -p) + interp(v[+1, 0], u, 0.1) - interp_dxdy(v[0, -1], p, p)*interp_dy(v, 0, 0)
  c = (p - (q - u))/(p/q)/(p*(q*u)) - (u < q) + (u == 0)
  d = max(p, -q)^2^p - (p^q)^2 + u^(-2) - (-2)^u + (p + q)^(1/p) - sin(abs(u)) - 2*u*v - p*(-3)
}

program r {
  fill u periodic
  fill v periodic
  run k
  keep a, b, c, d
}
)");
}

/// u and q are read by reductions alone.
TEST(Text, Reductions) {
  expect_same_again(R"(kernel k(m: field, p: field, out v: field) on 3 axes {
  v = m*p
}

program p {
  axes x periodic, y bounded, z periodic
  reduce m = mean u over y
  reduce p = max q over x, z
  run k
  reduce e = sum v
  reduce f = min v over z
  keep v, e, f
}

program lone {
  axes x periodic
  reduce m = mean u
  keep m
}
)");
}

TEST(Text, Boundaries) {
  expect_same_again(R"(kernel k(u: field halo 1, out v: field) {
  v = u[+1, 0, 0] + u[0, 0, +1]
}

program p {
  fill u x = a, y.low = 0, y.high = zero_gradient, z periodic
  run k
  keep v
}
)");
}

TEST(Text, FoldsGrownRunsSumsAndScatters) {
  expect_same_again(R"(kernel zero(out w: field) {
  w = 0
}

kernel k(u: field, d: field, inout w: field, sum s: param, sum s2: param) {
  w += u
  s += u^2
  s2 += -d
  interp(w, d) += 2*u
  interp_dx(w[-1], d) += u
}

program p {
  run zero grow 2
  run k
  fold w grow 2 x.low = zero_gradient, x.high = 0
  keep w
}
)");
}

TEST(Text, NumberOfAxesOfKernelsThatDoNotShowIt) {
  const std::string text = R"(kernel scale(u: field, out v: field) on 3 axes {
  v = 2*u
}

program p {
  axes x periodic, y bounded, z periodic
  run scale
  keep v
}
)";
  expect_same_again(text);
  EXPECT_EQ(module_of(text).kernels[0].rank, 3);
}

TEST(Text, NumberOfAxesComesFromTheProgramThatRunsIt) {
  const Module m = module_of(
      "kernel k(u: field, out v: field) { v = 2*u }\nprogram p { axes x bounded, y periodic; run k; keep v }\n");
  EXPECT_EQ(m.kernels[0].rank, 2);
  const Module other = module_of(R"(
kernel first(u: field, out v: field) { v = 2*u }
kernel second(v: field halo 1, out w: field) { w = v[+1, 0] }
program p { run first; fill v periodic; run second; keep w }
)");
  EXPECT_EQ(other.kernels[0].rank, 2);
  EXPECT_EQ(other.programs[0].axes, (std::vector<Topology>{Topology::periodic, Topology::periodic}));
}

TEST(Text, LoopsBackwardsOverSeveralPrograms) {
  expect_same_again(R"(kernel k(u: field, out v: field) {
  v = 2*u
}

program p {
  axes x periodic
  run k
  swap u, v
}

program q {
  axes x bounded
  run k
  swap u, v
}

loop step in 8 .. 0 { p; q }
)");
}

TEST(Text, NotAndPi) {
  const Module m = module_of("kernel k(u: field, out v: field) { v = if(not u < pi, 1, 0) }\n");
  EXPECT_EQ(print(m.kernels[0]),
            "kernel k(u: field, out v: field) {\n  v = if((u < 3.141592653589793) == 0, 1, 0)\n}\n");
}

TEST(Text, NumbersReadBackExactly) {
  for (const double value : {0.1, 1.0 / 3, 1e-300, 1e300, 123456789.0, 5e-324, 1e21}) {
    Module m = module_of("kernel k(out v: field) { v = 0 }\n");
    m.kernels[0].stores[0].value = Expr(value);
    EXPECT_TRUE(module_of(print(m)) == m) << print(m);
  }
}

const char* const sample = R"(kernel zero(out w: field) {
  w = 0
}

kernel k(u: field halo 1, d: field, out v: field, inout w: field, sum s: param, c: param) {
  let a = if(inside[-1] grow 1, u[-1], c)
  v = a*interp(u, d) - u^2
  s += a
  interp_dx(w[+1], d) += u
}

program p {
  fill u x.low = c, x.high = zero_gradient
  run zero grow 1
  run k
  fold w grow 1 x.low = 0, x.high = zero_gradient
  swap u, v
  keep w
}

loop n in 0 .. 3 { p }
)";

TEST(Text, WhatIsAcceptedIsSoundHoweverItIsDamaged) {
  expect_same_again(sample);
  std::mt19937 engine(4);
  const std::string text = sample;
  const auto place = [&] { return std::uniform_int_distribution<std::size_t>(0, text.size() - 12)(engine); };
  int accepted = 0;
  for (int i = 0; i < 4000; ++i) {
    std::string damaged = text;
    const std::size_t length = 1 + place() % 8;
    damaged.replace(place(), place() % 10, text.substr(place(), length));
    const SourceFile source("test.dpde", damaged);
    DiagnosticSink sink;
    const Module m = from_ast(parse(source, sink), sink);
    if (sink.has_errors()) continue;
    ++accepted;
    EXPECT_EQ(verify(m), std::vector<std::string>{}) << damaged;
    EXPECT_EQ(print(module_of(print(m))), print(m)) << damaged;
  }
  EXPECT_GT(accepted, 50);
}

/// Random trees through the constructors: every one reads back as itself.
class RandomTree {
 public:
  explicit RandomTree(unsigned seed) : engine_(seed) {}

  Expr tree(int depth) {
    if (depth == 0) return leaf();
    const auto below = [&] { return tree(depth - 1 - pick(std::min(depth, 2))); };
    switch (pick(12)) {
      case 0: return -below();
      case 1: return call(static_cast<Fn>(pick(14)), {below()});
      case 2: return call(pick(2) == 0 ? Fn::min : Fn::max, {below(), below()});
      case 3: return select(below(), below(), below());
      case 4:
        return interp({"w",
                       {pick(3) - 1, pick(3) - 1, 0},
                       {below(), below()},
                       {static_cast<InterpolationBasis>(pick(along_count)),
                        static_cast<InterpolationBasis>(pick(along_count)), InterpolationBasis::linear}});
      case 5: return inside({pick(3) - 1, pick(3) - 1, 0}, pick(2));
      default: return binary(static_cast<BinaryOp>(pick(13)), below(), below());
    }
  }

 private:
  int pick(int count) { return std::uniform_int_distribution<>(0, count - 1)(engine_); }
  Expr leaf() {
    switch (pick(5)) {
      case 0: return Expr(pick(7) - 3.0);
      case 1: return param("p");
      case 2: return access("u", {pick(3) - 1, pick(3) - 1, 0});
      case 3: return access("w");
      default: return Expr(0.25 * (pick(9) - 4));
    }
  }
  std::mt19937 engine_;
};

TEST(Text, RandomExpressionsReadBackAsThemselves) {
  RandomTree random(3);
  int large = 0;
  for (int i = 0; i < 2000; ++i) {
    Kernel kernel{"k", 2, {}, {{"out", false, random.tree(1 + i % 7), {}}}, {}, {}};
    const Module m{{kernel}, {}, {}};
    const Module again = module_of(print(m));
    ASSERT_TRUE(again == m) << print(m) << print(again);
    large += print(m).size() > 200;
  }
  EXPECT_GT(large, 100);
}

}  // namespace
}  // namespace dpde::stencil
