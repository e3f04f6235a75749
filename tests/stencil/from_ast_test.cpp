// SPDX-License-Identifier: Apache-2.0
// What is said about wrong kernels, programs and loops: code, message, the words it points at, and the hint.
#include "stencil/text/from_ast.h"

#include <fmt/format.h>

#include "stencil_text.h"

namespace dpde::stencil {
namespace {

std::vector<std::string> in_kernel(const std::string& parameters, const std::string& body) {
  return complaints("kernel k(" + parameters + ") {\n" + body + "\n}\n");
}

TEST(KernelErrors, UnknownNames) {
  EXPECT_EQ(in_kernel("u: field, out v: field, viscosity: param", "v = viscocity*u"),
            one("E0350 viscocity is not a parameter or let of kernel k | viscocity | did you mean viscosity?"));
  EXPECT_EQ(in_kernel("out v: field", "v = q9"), one("E0350 q9 is not a parameter or let of kernel k | q9 | add q9: "
                                                     "field or q9: param to the parameters of the kernel"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = u\nresult = u"),
            one("E0350 result is not a parameter or let of kernel k | result | add out result: field to the parameters "
                "of the kernel"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = later\nlet later = u").size(), 1u);
}

TEST(KernelErrors, Functions) {
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = sine(u)"),
            one("E0351 sine is not a function that kernels can call | sine | did you mean sin?"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = max(u)"), one("E0352 max takes 2 arguments, not 1 | max(u)"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = if(u, 1)"), one("E0352 if takes 3 arguments, not 2 | if(u, 1)"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = u[+1, 0] + interp(u, 1)"),
            one("E0352 interp takes 3 arguments, not 2 | interp(u, 1)"));
}

TEST(KernelErrors, Offsets) {
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = u[+1] + u[0, +1]"),
            one("E0353 u has 2 offsets, but kernel k has 1 axis | u[0, +1]"));
  EXPECT_EQ(in_kernel("u: field halo 1, out v: field", "v = u[+2]"),
            one("E0358 u is read 2 cells away, but its halo is 1 | u | write u: field halo 2"));
  EXPECT_EQ(in_kernel("c: param, out v: field", "v = c[+1]"),
            one("E0354 c is a param and cannot be used as a field | c[+1]"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "let l = u\nv = l[+1]"),
            one("E0354 l is a let and cannot be used as a field | l[+1] | a let exists at its own point only; displace "
                "the fields in it"));
}

TEST(KernelErrors, Distances) {
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = u[-1001]"),
            one("E0370 -1001 cells is not a distance between -1000 and 1000 | u[-1001]"));
  EXPECT_EQ(in_kernel("out v: field", "v = inside[0] grow -1"),
            one("E0370 -1 cells is not a distance between 0 and 1000 | inside[0] grow -1"));
}

TEST(KernelErrors, RacesShowTheRewrite) {
  const std::string second = "write to a second field, out u_next: field, and swap u, u_next in the program";
  EXPECT_EQ(in_kernel("u: field halo 1", "u = u[+1]"),
            one("E0355 kernel k writes u, which it also reads | u | " + second));
  EXPECT_EQ(in_kernel("inout u: field", "u += u[+1]"),
            one("E0355 kernel k writes u, which it also reads | u[+1] | " + second));
  EXPECT_EQ(in_kernel("w: field, out v: field", "v = w\nlet a = v"),
            one("E0355 kernel k writes v, which it also reads | v | give the value a name with let and use that"));
}

TEST(KernelErrors, Writes) {
  EXPECT_EQ(in_kernel("u: field, out v: field, sum s: param", "v = u"),
            one("E0356 s is declared sum but kernel k does not write it | s"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "let a = u"),
            one("E0356 v is declared out but kernel k does not write it | v"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v += u"),
            one("E0357 v is a field to be written and is written with = | v | declare inout v: field to add to it"));
  EXPECT_EQ(in_kernel("u: field, sum s: param", "s += u\nlet a = s"),
            one("E0354 s is a sum and cannot be used as a value | s | a sum is complete only after the kernel"));
  EXPECT_EQ(in_kernel("out v: field, c: param", "v = c\nc = 1"),
            one("E0354 c is a param and cannot be used as a result | c | declare sum c: param to add up values, or out "
                "c: field"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = u\nv = 2*u"),
            one("E0357 v is a field to be written and is written with one statement only | v | add the values in one "
                "expression"));
  EXPECT_EQ(in_kernel("u: field, w: field, out v: field", "v = u\ninterp(w, u) += u"),
            one("E0354 w is a field and cannot be used as a field to be added to | w | declare inout w: field"));
}

TEST(KernelErrors, NamesAndOddities) {
  EXPECT_EQ(in_kernel("u: field, u: param, out v: field", "v = u"),
            one("E0359 u is already the name of another parameter | u"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "let u = 1\nv = u"),
            one("E0359 u is already the name of a parameter | u"));
  EXPECT_EQ(in_kernel("out v: field", "v = \"text\""),
            one("E0360 a text cannot stand in a kernel or program | \"text\""));
  EXPECT_EQ(in_kernel("out v: field", "v = (1, 2)"), one("E0360 a tuple cannot stand in a kernel or program | (1, 2)"));
  EXPECT_EQ(in_kernel("u: field, out v: field", "v = u[0, 0, 0, 1]").front(),
            "E0360 a grid of 4 axes cannot stand in a kernel or program | k");
}

const std::string kernels = R"(kernel smooth(u: field halo 1, out v: field) { v = u[-1] + u[+1] }
kernel flat(u: field, out w: field) on 2 axes { w = u }
kernel more(u: field, inout v: field) { v += u }
)";

std::vector<std::string> in_program(const std::string& body) {
  return complaints(kernels + "program p { " + body + " }\n");
}

TEST(ProgramErrors, Names) {
  EXPECT_EQ(in_program("fill u periodic; run smoth; keep v").front(),
            "E0361 there is no kernel smoth | smoth | did you mean smooth?");
  EXPECT_EQ(in_program("fill uu periodic; run smooth; keep v").front(),
            "E0363 no kernel that program p runs has a field uu | uu | did you mean u?");
  EXPECT_EQ(in_program("fill u periodic; run smooth; swap u, u").front(), "E0364 program p does not write u | u");
  EXPECT_EQ(in_program("fill u periodic; run smooth; keep u").front(), "E0364 program p does not write u | u");
  EXPECT_EQ(complaints(kernels + "program p { fill u periodic; run smooth; keep v }\nloop n in 0 .. 3 { pp }\n"),
            one("E0362 there is no program pp | pp | did you mean p?"));
  EXPECT_EQ(complaints(kernels + kernels).size(), 3u);
}

TEST(ProgramErrors, AxesAndBoundaries) {
  EXPECT_EQ(in_program("fill u periodic; run smooth; run flat; keep v"),
            one("E0365 program p has 2 axes, but kernel smooth has 1 axis | smooth"));
  EXPECT_EQ(in_program("axes x bounded; fill u periodic; run smooth; keep v"),
            one("E0365 program p has a bounded axis x, but the fill of u has a periodic one | u"));
  EXPECT_EQ(in_program("fill u x.low = 0; run smooth; keep v"),
            one("E0366 the fill of u says nothing about x.high | u"));
  EXPECT_EQ(in_program("fill u y = 0; run flat; keep w"), one("E0366 the fill of u says nothing about x | u"));
  EXPECT_EQ(
      in_program("fill u x = 2*v; run smooth; keep v"),
      one("E0367 v is a field inside a value of a fill: that is made of params and numbers, or one field alone | v | "
          "store the values in a field by a kernel, and let the field stand alone"));
  EXPECT_EQ(in_program("fill u x = mixed(1, 2); run smooth; keep v").front(),
            "E0352 mixed takes 3 arguments, not 2 | mixed(1, 2)");
  EXPECT_EQ(in_program("fill u x.low = periodic, x.high = 0; run smooth; keep v").front(),
            "E0368 one side of an axis cannot be periodic by itself | periodic");
}

TEST(StencilFromAst, SolvesSayWhatIsWrong) {
  const auto in_solve = [](const std::string& head, const std::string& block, const std::string& rest = "") {
    const std::vector<std::string> all = complaints(
        "kernel k(w: field halo 1, out r: field) { r = w[-1] - 2*w + w[+1] } "
        "kernel s(w: field, out r: field, sum e: param) { r = w; e += w } "
        "kernel c(u: field, out r: field) { r = u } kernel x(w: field, out x: field) { x = w }" +
        rest + "program p { " + head + " { " + block + " }; keep w }");
    return all.empty() ? std::string() : all.front();
  };
  EXPECT_EQ(in_solve("solve r = u for w by cg tolerance 1e-8", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("solve r = u for w by gauss", "fill w periodic; run k").substr(0, 37),
            "E0368 gauss is no method to solve by ");
  EXPECT_EQ(in_solve("solve r = u for w by multigird", "fill w periodic; run k"),
            "E0368 multigird is no method to solve by | multigird | did you mean multigrid?");
  EXPECT_EQ(in_solve("solve r = u for w by multigrid smoother chebyshev", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("solve r = u for w by multigrid smoother jakobi", "fill w periodic; run k"),
            "E0368 jakobi is no smoother of multigrid | jakobi | did you mean jacobi?");
  EXPECT_EQ(in_solve("solve r = u for w from u by cg", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("solve r = u for w from w", "fill w periodic; run k").substr(0, 53),
            "E0368 program p solves for w, which it begins with | ");
  EXPECT_EQ(in_solve("newton r = u for w from u", "fill w periodic; run k"),
            "E0368 a linear solve for one field alone begins with a field | u | leave out from u");
  EXPECT_EQ(in_solve("solve r = u for w tolerance 2", "fill w periodic; run k"),
            "E0368 a tolerance is a number between 0 and 1 | 2 | as 1e-10");
  EXPECT_EQ(in_solve("solve r = u for w", "run k").substr(0, 69),
            "E0368 program p runs k, which reads neighbours of w, without a fill |");
  EXPECT_NE(
      in_solve("solve z = u for w", "fill w periodic; run k").find("solves for z, which its block does not write"),
      std::string::npos);
  EXPECT_NE(in_solve("solve r = u for w", "run c").find("solves for w, which its block does not read"),
            std::string::npos);
  EXPECT_EQ(in_solve("newton r = u for w", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("solve r, r = u for w", "fill w periodic; run k").substr(0, 91),
            "E0368 1 fields are sought, with 1 right sides for 2 fields that the block makes | w | name ");
  EXPECT_NE(in_solve("solve r = u for w", "run s").find("solves for w with sums or networks in the block"),
            std::string::npos);
  EXPECT_NE(in_solve("solve r = w for w", "fill w periodic; run k").find("solves for w, which is the right side"),
            std::string::npos);
  EXPECT_NE(in_solve("solve x = u for w", "run x").find("writes x, which is a coordinate"), std::string::npos);
}

TEST(ProgramErrors, Transforms) {
  const auto in_transform = [](const std::string& statement) {
    return complaints("program p {\naxes x periodic\n" + statement + "\nkeep v\n}\n").front();
  };
  const std::string polynomial = "E0368 a multiplier is a polynomial of ikx, iky, ikz | ";
  const std::string hint = " | write sums of products and powers up to 16, or phiN(polynomial)*polynomial";
  for (const std::string by : {"sin(ikx)", "1/ikx", "ikx^20", "ikx^nu"})
    EXPECT_EQ(in_transform("transform u by " + by + " to v"), polynomial + by + hint);
  EXPECT_EQ(in_transform("transform u by c*u*ikx to v"),
            "E0368 u is no number: a multiplier is the same at all cells | u | multiply by a field in a kernel, before "
            "the transform or behind it");
  EXPECT_EQ(in_transform("transform u by iky to v"),
            "E0368 a multiplier has a wave number along an axis that is not there | iky");
  EXPECT_EQ(in_transform("transform u by phid(ikx) to v").substr(0, 10), "E0351 phid");
  EXPECT_EQ(in_transform("transform u by phi20(ikx) to v"), "E0368 phi20 is above phi19, the highest one | phi20");
  EXPECT_EQ(in_transform("transform u by inverse20(ikx) to v"),
            "E0368 inverse20 is above inverse19, the highest one | inverse20");
  EXPECT_EQ(in_transform("transform u by phi99999999999(ikx) to v").substr(0, 36),
            "E0368 phi99999999999 is above phi19,");
  for (const auto& [by, name] : {std::pair{"phi1(ikx) + 1", "phi1(ikx)"},
                                 {"nu*phi12(ikx)", "phi12(ikx)"},
                                 {"phi1(phi2(ikx))", "phi2(ikx)"},
                                 {"phi1(ikx)*phi3(ikx)", "phi3(ikx)"},
                                 {"nu*inverse2(ikx)", "inverse2(ikx)"},
                                 {"phi4(ikx, 1)", "phi4(ikx, 1)"}}) {
    const std::string word = std::string(name).substr(0, std::string(name).find('('));
    EXPECT_EQ(complaints(fmt::format("program p {{ axes x periodic; transform u by {} to v; keep v }}", by)),
              one("E0368 " + word + " does not begin the multiplier, or has not one argument | " + name +
                  " | write phiN(polynomial)*polynomial or inverseN(polynomial)*polynomial, and a sum as several "
                  "terms: transform "
                  "u by ..., u by ... to v"));
  }
  EXPECT_EQ(complaints("program p { axes x periodic; transform u by ikx^20 to v; keep v }").size(), 1u);
  for (const std::string function : {"heaviside0(c*ikx^2 + 1)", "heaviside1(ikx^2 + 1)", "heaviside0(ikx)"}) {
    const std::vector<std::string> told =
        complaints("program p { axes x periodic; transform u by " + function + " to v; keep v }");
    ASSERT_EQ(told.size(), 1u) << function;
    EXPECT_NE(told.front().find("none of heaviside0 of numbers and even powers"), std::string::npos) << told.front();
  }
  EXPECT_EQ(in_transform("transform v by ikx to v"),
            "E0368 program p transforms v to itself | transform v by ikx to v");
  EXPECT_EQ(complaints("program p { axes x bounded; transform u by ikx to v; keep v }"),
            one("E0368 program p transforms to v along an axis that is not periodic | transform u by ikx to v"));
  EXPECT_EQ(complaints("program p { axes x periodic, y bounded; transform u by ikx within two_thirds to v; keep v }"),
            one("E0368 program p transforms to v along an axis that is not periodic | "
                "transform u by ikx within two_thirds to v"));
  EXPECT_EQ(complaints("program p { axes x periodic; transform u by ikx to v; transform u by 2 to v; keep v }"),
            one("E0368 program p writes v twice | transform u by 2 to v"));
}

TEST(ProgramErrors, Distances) {
  EXPECT_EQ(in_program("axes x bounded; fill u x = 0; run smooth grow 5000; keep v"),
            one("E0370 5000 cells is not a distance between 0 and 1000 | run smooth grow 5000"));
}

TEST(ProgramErrors, WhatTheVerifierFinds) {
  EXPECT_EQ(in_program("run smooth; keep v"),
            one("E0368 program p runs smooth, which reads neighbours of u, without a fill | run smooth"));
  EXPECT_EQ(in_program("fill u periodic; run smooth; run smooth; keep v"),
            one("E0368 program p writes v twice | run smooth"));
  EXPECT_EQ(in_program("run more; keep v"), one("E0368 program p adds to v before it is written | run more"));
  EXPECT_EQ(in_program("fill u periodic; run smooth"),
            one("E0369 program p has no result | p | name the fields it computes, as in keep v or swap u, v"));
}

}  // namespace
}  // namespace dpde::stencil
