// SPDX-License-Identifier: Apache-2.0
#include "lsp/word_texts.h"

#include <algorithm>
#include <span>

namespace dpde::lsp {

namespace {

constexpr WordText functions[] = {
    {"dx", "dx(f)", "the derivative along x; the scheme's dx says how"},
    {"dy", "dy(f)", "the derivative along y; the scheme's dx says how"},
    {"dz", "dz(f)", "the derivative along z; the scheme's dx says how"},
    {"d", "d(f, x, 2)", "a derivative along an axis, of any order"},
    {"lap", "lap(f)", "the sum of the second derivatives along all axes; the scheme's lap says how"},
    {"grad", "grad(f)", "the vector of the derivatives of a number, of a vector the tensor d v_i/dx_j"},
    {"div", "div(v)", "the divergence of a vector, of a tensor that of each row"},
    {"advect", "advect(v, f)", "v . grad(f); the scheme's advect says how"},
    {"bracket", "bracket(a, b)", "dx(a)*dy(b) - dy(a)*dx(b), by Arakawa's form"},
    {"dot", "dot(v, w)", "the product of two vectors, or of a tensor and a vector"},
    {"curl", "curl(v)", "the rotation: a number on two axes, a vector on three; of a number (dy(s), -dx(s))"},
    {"norm", "norm(v)", "the length of a vector; |v| is the same"},
    {"if", "if(condition, a, b)", "a where the condition is true, else b"},
    {"mean", "mean(f), mean(f, x)", "the mean over the grid, or along axes"},
    {"band_pass", "band_pass(f, 4, 8)", "in losses, tests and observables: what the waves of f in shells 4 to 8 make"},
    {"average", "average(mean(u^2))", "in a loss: the mean over all states that it looks at"},
    {"sum", "sum(f), sum(f, x), sum(c[j], j)", "the sum over the grid, along axes, or over an index"},
    {"integral", "integral(f), integral(f, x)", "the sum times the size of the cells"},
    {"inject", "inject(f, at = (x0, y0))", "a density whose integral is f, one cell wide around a place"},
    {"sample", "sample(u, at = (x0, y0))", "the value of a field or a formula at a place"},
    {"interpolate", "interpolate(f)", "f, from where it lies to where it is wanted"},
    {"random_field", "random_field(seed = 1, lowest = 2, highest = 8)", "a sum of waves in space with random phases"},
    {"random_signal", "random_signal(seed = 1, lowest = 1, highest = 20)", "a sum of waves in time with random phases"},
    {"noise", "noise(1)", "a standard normal number in each cell"},
    {"force_on", "force_on(solid, u)", "the force on what a mask holds"},
    {"torque_on", "torque_on(solid, u, about = (x0, y0))", "the torque on what a mask holds"},
    {"cross", "cross(s, v)", "(-s*v.y, s*v.x), on two axes"},
    {"outer", "outer(v, w)", "the tensor of the products v_i w_j"},
    {"inner", "inner(S, T)", "the sum of the products of all components"},
    {"sym", "sym(S)", "(S + transpose(S))/2"},
    {"transpose", "transpose(S)", "the tensor with rows and columns exchanged"},
    {"trace", "trace(S)", "the sum of the diagonal"},
    {"sin", "sin(a)", "sine"},
    {"cos", "cos(a)", "cosine"},
    {"tan", "tan(a)", "tangent"},
    {"asin", "asin(a)", "inverse sine"},
    {"acos", "acos(a)", "inverse cosine"},
    {"atan", "atan(a)", "inverse tangent"},
    {"atan2", "atan2(y, x)", "the angle of (x, y) with the x axis, from -pi to pi"},
    {"sinh", "sinh(a)", "hyperbolic sine"},
    {"cosh", "cosh(a)", "hyperbolic cosine"},
    {"tanh", "tanh(a)", "hyperbolic tangent"},
    {"exp", "exp(a)", "exponential"},
    {"log", "log(a)", "natural logarithm"},
    {"erf", "erf(a)", "error function"},
    {"sqrt", "sqrt(a)", "square root"},
    {"abs", "abs(a)", "absolute value; |a| is the same"},
    {"sign", "sign(a)", "-1, 0 or 1"},
    {"floor", "floor(a)", "the largest whole number that is not above a"},
    {"fraction", "fraction(a)", "a - floor(a)"},
    {"min", "min(a, b), min(u, over = x)", "the smaller of two numbers, or the smallest of a field"},
    {"max", "max(a, b), max(u, over = x)", "the larger of two numbers, or the largest of a field"},
};

constexpr WordText blocks[] = {
    {"model", "model heat { field u; param k; dt(u) = k*lap(u) }", "the physics: fields, parameters, equations"},
    {"scene", "scene rod : heat with plain { ... }", "where and when: grid, boundaries, initial state, duration"},
    {"scheme", "scheme plain { lap = central(2); time = rk4 }", "the discretisation"},
    {"task", "task find : rod { unknown k from 1; minimise ... }",
     "what is asked: data, unknowns, a loss, an optimiser"},
    {"kernel", "kernel step(u: field halo 1, out v: field) { ... }", "what is done in each cell"},
    {"program", "program step { fill u periodic; run k; swap u, v }", "kernels in the order in which they run"},
    {"loop", "loop t in 0 .. 32 { step }", "how often a program runs"},
    {"function", "function f(a, b) = a*b", "a shorthand with arguments"},
    {"operator", "operator lap9(u) order 2 = ...", "a formula of neighbours, with the order that it has"},
    {"network", "network n(u) -> scalar { conv 32, 5; relu }", "layers whose weights are learned"},
    {"dataset", "dataset train : rod { runs 10; vary k in 0.1 .. 1 }", "runs of a scene, in one file"},
    {"chart", "chart cost : rod { vary cells in 64, 128; error l2(u) }", "error against time of a scene's variants"},
    {"import", "import \"flow.dpde\"", "the blocks of another file"},
};

constexpr WordText keys[] = {
    {"advect", "advect = upwind(3)", "how advect(v, f) is discretised; advect marker = ... of one field"},
    {"dx", "dx = central(4)", "how first derivatives are discretised"},
    {"lap", "lap = central(4)", "how second derivatives are discretised"},
    {"dealias", "dealias = two_thirds", "cuts the waves that products fold back"},
    {"implicit", "implicit = all", "which terms implicit steps solve for"},
    {"solve", "solve = cg(1e-10)", "how equations are solved, and how well"},
    {"smoother", "smoother = jacobi", "what cycles of multigrid smooth by"},
    {"preconditioner", "preconditioner = none", "what iterations of cg, bicgstab and gmres are preconditioned by"},
    {"guess", "guess = last", "what solves begin with"},
    {"project", "project = step", "how often a step makes constraints true"},
    {"time", "time = rk4", "how steps in time are made"},
    {"real", "real = f32", "the precision of fields"},
    {"networks", "networks = f64", "the precision of networks"},
    {"split", "split = strang(advect, diffusion)", "split steps"},
};

struct Lines {
  std::string_view block;
  std::span<const WordText> texts;
};

constexpr WordText of_models[] = {
    {"field", "field u, v on faces", "a number in each cell, with an equation"},
    {"vector", "vector u on faces", "a field with a component for each axis"},
    {"coefficient", "coefficient kappa", "a field that is given and stays"},
    {"mask", "mask solid", "where a condition of the scene is true"},
    {"param", "param nu = 0.01", "a number, which the scene may set"},
    {"control", "control field F", "a number or field with a value for each interval of time"},
    {"let", "let s = u + v", "a shorthand"},
    {"dt", "dt(u) = k*lap(u)", "the equation of a field; dt(dt(u)) is of second order"},
    {"solve", "solve lap(psi) = -omega for psi", "a field that makes an equation true at each moment"},
};
constexpr WordText of_scenes[] = {
    {"grid", "grid x = 0 .. 1, cells 64, periodic", "an axis"},
    {"cells", "cells 64, 32", "the cells of all axes, or of one after the other"},
    {"let", "let k = 2*pi", "a shorthand, of coordinates too"},
    {"coordinates", "coordinates polar", "what lengths the coordinates have"},
    {"initial", "initial u = sin(x)", "the state at the begin"},
    {"exact", "exact u = exp(-t)*sin(x)", "the solution, to measure errors"},
    {"boundary", "boundary u: x.low = 0, x.high = zero_gradient", "what holds at the sides"},
    {"time", "time 0 .. 1, step 1/64", "duration and step"},
    {"step", "step 1/64", "the step, of a scene made from another or of a loop"},
    {"after", "after step: u = max(u, 0)", "what happens behind each step"},
    {"every", "every 0.1: u += 1", "what happens in intervals"},
    {"at", "at t = 0.5: u = 0", "what happens at times"},
    {"subcycle", "subcycle b, c in 4", "equations with substeps"},
    {"observe", "observe mass = integral(u)", "a number that runs report"},
    {"output", "output u every 0.1", "what runs write, and when"},
    {"accuracy", "accuracy 1e-3 on u", "the error that is wanted"},
};
constexpr WordText of_tasks[] = {
    {"data", "data seen = u from scene truth at t = 1", "what is compared with: of a file or of another scene"},
    {"unknown", "unknown k from 1 in 0 .. 2", "what is sought"},
    {"learn", "learn corrector", "a network whose weights are sought"},
    {"minimise", "minimise mean((u - seen)^2) at t = 1", "the loss"},
    {"using", "using lbfgs(), iterations 50", "the optimiser"},
    {"test", "test error = mean(abs(u - seen))", "a number reported after optimising"},
    {"statistic", "statistic e = mean(u^2) on trajectories(\"a.nc\") for 9 steps",
     "mean and deviation over time, beside the data's"},
    {"spectrum", "spectrum e = u on trajectories(\"a.nc\") for 9 steps", "the mean spectrum, beside the data's"},
    {"correlation", "correlation c = u above 0.8 on trajectories(\"a.nc\") for 9 steps",
     "how long runs follow the data"},
    {"growth", "growth rate on trajectories(\"a.nc\") for 9 steps", "how fast small perturbations grow"},
};
constexpr WordText of_kernels[] = {
    {"let", "let a = u[+1] - u[-1]", "a shorthand"},
    {"adjoint", "adjoint u_bar += v_bar", "in place of the derived adjoint"},
};
constexpr WordText of_programs[] = {
    {"fill", "fill u x periodic, y.low = 0", "the values beyond the sides"},
    {"fold", "fold u grow 1 x periodic", "the transpose of a fill"},
    {"reduce", "reduce m = mean u over x", "values along axes become one"},
    {"run", "run step grow 1", "runs a kernel in all cells"},
    {"transform", "transform u by nu*ikx^2 to v", "each wave times a polynomial of its wave numbers"},
    {"apply", "apply n(a, b) to c", "what a network makes"},
    {"tangent", "tangent n(a) by a_dot to c_dot weights", "the tangent of a network"},
    {"adjoint", "adjoint n(a) by c_bar to a_bar weights", "the adjoint of a network"},
    {"second", "second n(a) by a_dot, c_bar to a_bar, a_dot_bar", "the adjoint of the tangent of a network"},
    {"repeat", "repeat 8 { ... }", "a block so many times"},
    {"solve", "solve y = b for x { ... }", "the field for which a linear block makes b"},
    {"newton", "newton y = b for x { ... }", "the field for which a block makes b"},
    {"save", "save u in passes", "keeps a field for the adjoint of a repeat"},
    {"load", "load u from passes", "takes it back"},
    {"swap", "swap u, v", "v is u from now on"},
    {"keep", "keep w", "a result beside those of swap"},
    {"axes", "axes x periodic, y bounded", "of a program no fill of which tells"},
};
constexpr WordText of_networks[] = {
    {"padding", "padding x periodic, y zero", "what layers read beyond the sides"},
    {"initial", "initial he, seed 7", "the weights that training begins with"},
    {"symmetric", "symmetric flips, rotations", "symmetries that hold exactly"},
    {"real", "real f64", "the precision"},
    {"host", "host weights 120", "a host program computes it, in place of layers"},
    {"repeat", "repeat 3 shared { ... }", "layers so many times"},
    {"residual", "residual { conv 32, 5; relu }", "what goes in is added to what the layers make"},
    {"skip", "skip { mean_pool 2; upsample 2 }", "what goes in stands beside what the layers make"},
    {"let", "let c = add(a, b)", "a value with a name"},
};
constexpr WordText of_data_sets[] = {
    {"runs", "runs 10", "how many"},
    {"seed", "seed 3", "of the random numbers"},
    {"vary", "vary nu in 0.01 .. 0.1", "a parameter that differs from run to run"},
    {"frames", "frames of u, omega = curl(u) every 0.1 from 3 to 23", "what is kept of each run, and when"},
    {"coarsen", "coarsen 4", "keeps means of so many cells along each axis"},
    {"file", "file \"train.nc\"", "where they are written"},
};
constexpr WordText of_charts[] = {
    {"reference", "reference exact", "what errors are measured against"},
    {"vary", "vary cells in 64, 128, 256", "what differs"},
    {"error", "error l2(u) at t = 1", "the norm that is shown"},
    {"gradient", "gradient find", "errors of the gradient of a task"},
    {"tolerance", "tolerance 1e-3", "of which the cheapest variant is told"},
};

constexpr Lines lines[] = {{"model", of_models},     {"scene", of_scenes},      {"task", of_tasks},
                           {"kernel", of_kernels},   {"program", of_programs},  {"repeat", of_programs},
                           {"network", of_networks}, {"dataset", of_data_sets}, {"chart", of_charts}};

const WordText* find(std::span<const WordText> texts, std::string_view word) {
  const auto found = std::ranges::find(texts, word, &WordText::word);
  return found == texts.end() ? nullptr : &*found;
}

}  // namespace

const WordText* text_of_function(std::string_view word) { return find(functions, word); }

const WordText* text_of_line(std::string_view block, std::string_view word) {
  const auto* found = std::ranges::find(lines, block, &Lines::block);
  return found == std::end(lines) ? nullptr : find(found->texts, word);
}

const WordText* text_of_block(std::string_view word) { return find(blocks, word); }

const WordText* text_of_key(std::string_view key) { return find(keys, key); }

std::string_view key_of_function(std::string_view word) {
  constexpr std::string_view first[] = {"dx", "dy", "dz", "d", "grad", "div", "curl", "bracket", "interpolate"};
  if (word == "advect" || word == "lap") return word;
  return std::ranges::find(first, word) == std::end(first) ? "" : "dx";
}

}  // namespace dpde::lsp
