// SPDX-License-Identifier: Apache-2.0
// Tensors: what formulas are made of them, component by component; what fits and what does not.
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// The model m with vector u, field p and the vector coefficient w in a scene with as many axes.
std::string tensor_text(const std::string& of_u, const std::string& of_p, int axes, const std::string& lets = "",
                        const std::string& on = "") {
  std::string text = "model m {\n  vector u " + on + "\n  field p\n  coefficient vector w\n  param a\n" + lets;
  text += "  dt(u) = " + of_u + "\n  dt(p) = " + of_p + "\n}\nscene s : m {\n";
  for (int axis = 0; axis < axes; ++axis)
    text += std::string("  grid ") + "xyz"[axis] + " = 0 .. 1, cells 8, periodic\n";
  return text + "  w = 0\n  a = 2\n  initial p = 0\n  initial u = 0\n  time 0 .. 1, step 1/8\n";
}

std::string right_sides(const std::string& of_u, const std::string& of_p, int axes, const std::string& lets = "") {
  std::string text;
  for (const State& state : problem_of(tensor_text(of_u, of_p, axes, lets) + "}\n").states)
    text += state.name + ": " + print(*state.rhs) + "\n";
  return text;
}

TEST(Tensors, GradientAndDivergence) {
  EXPECT_EQ(right_sides("div(grad(u))", "trace(grad(u))", 2),
            "u.x: dx(dx(u.x)) + dy(dy(u.x))\nu.y: dx(dx(u.y)) + dy(dy(u.y))\np: dx(u.x) + dy(u.y)\n");
  EXPECT_EQ(right_sides("dot(grad(u), w)", "grad(u).xy", 2),
            "u.x: dx(u.x)*w.x + dy(u.x)*w.y\nu.y: dx(u.y)*w.x + dy(u.y)*w.y\np: dy(u.x)\n");
  EXPECT_EQ(right_sides("dot(w, grad(u))", "transpose(grad(u)).xy", 2),
            "u.x: dx(u.x)*w.x + dx(u.y)*w.y\nu.y: dy(u.x)*w.x + dy(u.y)*w.y\np: dx(u.y)\n");
}

TEST(Tensors, OfProductsAndIdentity) {
  EXPECT_EQ(right_sides("-div(outer(u, w) + p*identity)", "0", 2),
            "u.x: -(dx(u.x*w.x + p) + dy(u.x*w.y))\nu.y: -(dx(u.y*w.x) + dy(u.y*w.y + p))\np: 0\n");
  EXPECT_EQ(right_sides("div(2*a*sym(grad(u)))", "0", 2),
            "u.x: dx(2*a*dx(u.x)) + dy(2*a*((dy(u.x) + dx(u.y))/2))\n"
            "u.y: dx(2*a*((dy(u.x) + dx(u.y))/2)) + dy(2*a*dy(u.y))\np: 0\n");
  EXPECT_EQ(right_sides("div(((p, 2*p), (u.x, u.y)))", "inner(u, w) + inner(outer(u, w), identity)", 2),
            "u.x: dx(p) + dy(2*p)\nu.y: dx(u.x) + dy(u.y)\np: u.x*w.x + u.y*w.y + (u.x*w.x + u.y*w.y)\n");
}

TEST(Tensors, ServeAnyNumberOfAxes) {
  const std::string flux = "-div(outer(u, u) + p*identity - a*sym(grad(u)))";
  EXPECT_EQ(right_sides(flux, "trace(grad(u))", 1), "u.x: -dx(u.x*u.x + p - a*dx(u.x))\np: dx(u.x)\n");
  EXPECT_EQ(problem_of(tensor_text(flux, "trace(grad(u))", 3) + "}\n").states.size(), 4u);
  EXPECT_EQ(right_sides("div(S)", "S.xx", 2, "  let S = if(p > 0, grad(u), 2*grad(u))\n"),
            right_sides("div(if(p > 0, grad(u), 2*grad(u)))", "if(p > 0, dx(u.x), 2*dx(u.x))", 2));
}

TEST(Tensors, InFunctions) {
  const std::string functions = "function pull(T) = T - trace(T)*identity/2\nfunction corner(T) = T.yx\n";
  const std::string text = tensor_text("div(pull(grad(u)))", "corner(outer(u, w))", 2) + "}\n";
  const Problem p = problem_of(functions + text);
  EXPECT_EQ(print(*p.states[2].rhs), "u.y*w.x");
  EXPECT_EQ(print(*p.states[0].rhs), "dx(dx(u.x) - (dx(u.x) + dy(u.y))/2) + dy(dy(u.x))");
}

TEST(Tensors, TheSquareOfANormIsASumOfSquares) {
  EXPECT_EQ(right_sides("0", "|u - w|^2 + norm(u)^2 + |p|^2", 2),
            "u.x: 0\nu.y: 0\np: (u.x - w.x)*(u.x - w.x) + (u.y - w.y)*(u.y - w.y) + (u.x*u.x + u.y*u.y) + abs(p)^2\n");
}

/// A mean of a sum is the sum of means, each over the points where its term lies.
TEST(Tensors, SumsOfSquaresOfStaggeredVectors) {
  const auto loss = [](const std::string& value) {
    const std::string text = tensor_text("0", "0", 2, "", "on faces") + "}\ntask t : s {\n  data r = u from scene s\n" +
                             "  unknown initial u\n  minimise " + value + "\n}\n";
    return print(problem_of(text).task->losses.front().value);
  };
  const std::string squares = "mean((u.x - r.x)*(u.x - r.x)) + mean((u.y - r.y)*(u.y - r.y))";
  EXPECT_EQ(loss("mean(dot(u - r, u - r))"), squares);
  EXPECT_EQ(loss("mean(|u - r|^2)"), squares);
  EXPECT_EQ(loss("integral((x*dot(u, u) + p)/2)"), "integral(x*(u.x*u.x)/2) + integral(x*(u.y*u.y)/2) + integral(p/2)");
  EXPECT_EQ(loss("sum(p^2 - dot(u, u))"), "sum(p^2) + sum(-(u.x*u.x)) + sum(-(u.y*u.y))");
}

TEST(Tensors, LieOnEdges) {
  const auto placements = [](const std::string& declared, int axes) {
    std::string text = "model m { " + declared + "; dt(e) = 0 }\nscene s : m {\n";
    for (int axis = 0; axis < axes; ++axis)
      text += std::string("  grid ") + "xyz"[axis] + " = 0 .. 1, cells 4, periodic\n";
    std::string places;
    for (const State& state : problem_of(text + "  initial e = 0\n  time 0 .. 1, step 1\n}\n").states) {
      for (const bool along : state.placement) places += along ? "1" : "0";
      places += " ";
    }
    return places;
  };
  EXPECT_EQ(placements("vector e on edges", 3), "011 101 110 ");
  EXPECT_EQ(placements("vector e on edges", 2), "010 100 ");
  EXPECT_EQ(placements("vector e on edges", 1), "000 ");
  EXPECT_EQ(placements("field e on edges.z", 3), "110 ");
  EXPECT_EQ(placements("field e on edges.z", 2), "110 ");
  EXPECT_EQ(placements("field e on edges.x", 2), "010 ");
}

}  // namespace
}  // namespace dpde::model
