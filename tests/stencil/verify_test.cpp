// SPDX-License-Identifier: Apache-2.0
// Every fault planted into a correct module is named, and nothing else is.
#include "stencil/analyse/verify_stencil.h"
#include "stencil_text.h"

namespace dpde::stencil {
namespace {

const char* const correct = R"(
kernel step(u: field halo 1, d: field, out u_next: field, sum s: param, nu: param) {
  let a = u[+1] - u[-1]
  let b = a + nu
  u_next = interp(u, d)*b
  s += a
}
kernel zero(out w: field) { w = 0 }
kernel back(u: field, d: field, inout w: field) {
  let e = 2*u
  w += e
  interp(w, d) += e
}
program p {
  fill u x.low = nu, x.high = zero_gradient
  run step
  run zero grow 1
  run back
  fold w grow 1 x.low = 0, x.high = zero_gradient
  swap u, u_next
  keep w
}
loop n in 0 .. 3 { p }
)";

template <class Fault>
std::vector<std::string> with(const Fault& fault) {
  Module m = module_of(correct);
  fault(m);
  return verify(m);
}

TEST(Verify, AcceptsTheCorrectModule) {
  EXPECT_EQ(with([](Module&) {}), std::vector<std::string>{});
}

TEST(Verify, Locals) {
  EXPECT_EQ(with([](Module& m) { std::swap(m.kernels[0].lets[0], m.kernels[0].lets[1]); }),
            one("kernel step uses local a before it is defined"));
  EXPECT_EQ(with([](Module& m) { m.kernels[0].lets.push_back({"a", 1.0}); }), one("kernel step defines local a twice"));
  EXPECT_EQ(with([](Module& m) { m.kernels[0].sums[0].value = local("z"); }),
            one("kernel step uses local z before it is defined"));
}

TEST(Verify, Names) {
  EXPECT_EQ(with([](Module& m) { m.kernels[0].lets[1].value = local("a") + param("u"); }),
            (std::vector<std::string>{"kernel step uses u both as field and as param",
                                      "program p uses u both as field and as param"}));
  EXPECT_EQ(with([](Module& m) { m.kernels[2].lets[0].value = param("w"); }).front(),
            "kernel back uses w both as field and as param");
  EXPECT_EQ(with([](Module& m) { m.kernels.push_back(m.kernels[1]); }), one("there are two kernels zero"));
}

TEST(Verify, ShapesOfNodes) {
  EXPECT_EQ(with([](Module& m) {
              m.kernels[2].stores[0].value = access("u", {0, 1});
            }).front(),
            "kernel back has an offset of u along an axis it does not have");
  EXPECT_EQ(with([](Module& m) { m.kernels[2].scatters[0].target.displacement.push_back(0.0); }),
            one("kernel back interpolates w with 2 displacements"));
  EXPECT_EQ(with([](Module& m) { m.kernels[2].scatters[0].target.along[1] = InterpolationBasis::slope; }),
            one("kernel back takes a slope of w along an axis it does not have"));
  EXPECT_EQ(with([](Module& m) {
              m.kernels[0].sums[0].value = Expr(Node{Call{Fn::max, {Expr(1.0)}}});
            }),
            one("kernel step calls max with 1 arguments"));
  EXPECT_EQ(with([](Module& m) { m.kernels[1].rank = 4; }).front(), "kernel zero has 4 axes");
}

TEST(Verify, StoresAndReads) {
  EXPECT_EQ(with([](Module& m) { m.kernels[0].stores[0].value = access("u_next"); }).front(),
            "kernel step both reads and writes u_next");
  EXPECT_EQ(with([](Module& m) {
              m.kernels[2].scatters.clear();
              m.kernels[2].stores[0].value = access("w", {1});
            }).front(),
            "kernel back adds to w and reads it at an offset");
  EXPECT_EQ(with([](Module& m) { m.kernels[2].stores.push_back(m.kernels[2].stores[0]); }),
            one("kernel back stores w twice"));
  EXPECT_EQ(with([](Module& m) { m.kernels[0].sums.push_back(m.kernels[0].sums[0]); }),
            one("kernel step has two sums s"));
}

TEST(Verify, Scatters) {
  EXPECT_EQ(with([](Module& m) { m.kernels[2].stores[0].value = access("w"); }),
            one("kernel back both reads w and scatters to it"));
  EXPECT_EQ(with([](Module& m) {
              m.kernels[1].scatters = {{{"v", {}, {0.0}, {}}, local("l")}};
              m.kernels[1].lets = {{"l", access("w")}};
            }).at(1),
            "kernel zero stores w, which a scatter reads");
}

TEST(Verify, Runs) {
  EXPECT_EQ(with([](Module& m) { std::get<stencil::Run>(m.programs[0].body[1]).kernel = "stop"; }),
            (std::vector<std::string>{"program p runs stop, which does not exist",
                                      "program p swaps u_next, which it does not write"}));
  EXPECT_EQ(with([](Module& m) { m.kernels[0].rank = 2; }).back(), "program p swaps u_next, which it does not write");
  EXPECT_EQ(
      with([](Module& m) { std::swap(m.programs[0].body[2], m.programs[0].body[3]); }),
      (std::vector<std::string>{"program p adds to w before it is written", "program p writes w after adding to it"}));
  EXPECT_EQ(with([](Module& m) { m.programs[0].body.push_back(stencil::Run{"zero"}); }),
            (std::vector<std::string>{"program p writes w after adding to it", "program p writes w twice"}));
}

TEST(Verify, FillsAndFolds) {
  EXPECT_EQ(with([](Module& m) { m.programs[0].body.erase(m.programs[0].body.begin()); }),
            one("program p runs step, which reads neighbours of u, without a fill"));
  EXPECT_EQ(with([](Module& m) { std::get<Fill>(m.programs[0].body[0]).axes[0].topology = Topology::periodic; }),
            one("program p has other axes than the boundaries of u"));
  EXPECT_EQ(with([](Module& m) { std::get<Fill>(m.programs[0].body[0]).axes[0].low.value = access("d") + 1.0; }),
            one("program p has a boundary value of u that is neither a field nor made of params and numbers"));
  EXPECT_EQ(with([](Module& m) { std::get<Fill>(m.programs[0].body[0]).axes[0].low.value = access("u"); }).front(),
            "program p has a boundary value of u that is u itself");
  EXPECT_EQ(with([](Module& m) { std::get<Fill>(m.programs[0].body[0]).axes[0].low.value = access("d"); }),
            (std::vector<std::string>{"program p fills u from d before that is written",
                                      "program p runs step, which reads u farther out than d was computed"}));
  EXPECT_EQ(with([](Module& m) { std::swap(m.programs[0].body[1], m.programs[0].body[4]); }).front(),
            "program p folds w before it is written");
  EXPECT_EQ(with([](Module& m) { std::get<Fold>(m.programs[0].body[4]).grow = 9; }),
            one("program p folds w farther out than it was computed"));
}

TEST(Verify, ReadsOnBoundedAxesMayBeMaskedOrComputedOnAGrownRegion) {
  const std::string text = R"(kernel a(u: field, out v: field) { v = u }
kernel plain(v: field halo 1, out w: field) { w = v[+1] }
kernel masked(v: field halo 1, out w: field) { w = if(inside[+1], v[+1], 0) }
program p { fill u x = 0; run a grow 1; run plain; keep w }
program q { axes x bounded; run a; run masked; keep w }
)";
  EXPECT_EQ(verify(module_of(text)), std::vector<std::string>{});
  Module m = module_of(text);
  std::get<stencil::Run>(m.programs[0].body[1]).grow = 0;
  EXPECT_EQ(verify(m), one("program p runs plain, which reads neighbours of v, without a fill"));
  m = module_of(text);
  m.programs[0].body.erase(m.programs[0].body.begin());
  EXPECT_EQ(verify(m), one("program p runs a, which reads neighbours of u, without a fill"));
  m = module_of(text);
  m.programs[1].axes = {Topology::periodic};
  EXPECT_EQ(verify(m), one("program q runs masked, which reads neighbours of v, without a fill"));
}

TEST(Verify, WallsAreKnownAsFarAsTheirOwnFillsLeaveThem) {
  const std::string text = R"(kernel a(u: field, out v: field) { v = u }
kernel b(u: field, out w: field) { w = u }
kernel far(u: field halo 2, out r: field) { r = u[+2] }
program p { fill u x = 0; run a grow 1; run b grow 2; fill u x = w; run far; keep r }
)";
  EXPECT_EQ(verify(module_of(text)), std::vector<std::string>{});
  Module m = module_of(text);
  std::vector<stencil::Statement>& body = m.programs[0].body;
  const Fill of_wall{"w", {{Topology::bounded, {SideKind::value, access("v")}, {SideKind::value, 0.0}}}};
  body.insert(body.begin() + 3, of_wall);
  EXPECT_EQ(verify(m), one("program p runs far, which reads u farther out than w was computed"));
  std::swap(body[3], body[4]);  // u has its values by then
  EXPECT_EQ(verify(m), std::vector<std::string>{});
}

TEST(Verify, Reductions) {
  const std::string text = R"(kernel k(m: field, u: field, out v: field) { v = m*u }
program p { axes x bounded; reduce m = mean u; run k; keep v }
)";
  const auto changed = [&](auto change) {
    Module m = module_of(text);
    change(m.programs[0].body, std::get<Reduce>(m.programs[0].body[0]));
    return verify(m);
  };
  EXPECT_EQ(changed([](auto&, Reduce&) {}), std::vector<std::string>{});
  EXPECT_EQ(changed([](auto&, Reduce& r) { r.over = {}; }), one("program p reduces u along no axis"));
  EXPECT_EQ(changed([](auto&, Reduce& r) { r.over[1] = true; }),
            one("program p reduces u along an axis it does not have"));
  EXPECT_EQ(changed([](auto&, Reduce& r) { r.field = "m"; }), one("program p reduces m to itself"));
  EXPECT_EQ(changed([](auto& body, Reduce& r) { body.insert(body.begin(), r); }), one("program p writes m twice"));
}

TEST(Verify, Results) {
  EXPECT_EQ(with([](Module& m) { m.programs[0].keeps.push_back("d"); }),
            one("program p keeps d, which it does not write"));
  EXPECT_EQ(with([](Module& m) { m.programs[0].swaps.push_back({"u", "w"}); }), one("program p swaps u twice"));
  EXPECT_EQ(with([](Module& m) { m.loops[0].programs = {"q"}; }), one("a loop runs q, which does not exist"));
}

}  // namespace
}  // namespace dpde::stencil
