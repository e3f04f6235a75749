// SPDX-License-Identifier: Apache-2.0
#include "model/methods.h"

#include <algorithm>

#include "support/assert.h"

namespace dpde::model {

namespace {

constexpr StageRow euler[] = {{0, 0, 0, 1, 1}};
constexpr StageRow midpoint_rule[] = {{0, 0, 0, 1, 2}, {0.5, 1, 0, 1, 1}};
/// Kutta 1901: U_4 = (U_1 + 2*U_2 + U_3 - U_0)/3 + dt/6*F(U_3).
constexpr StageRow runge_kutta_4[] = {
    {0, 0, 0, 1, 2}, {0.5, 1, 0, 1, 2}, {0.5, 2, 0, 1, 1}, {1, 3, 2, 1, 6, 3, {{{1, 2}, {3, 0}}}}};
/// Shu and Osher 1988: U_2 = 3/4*U_0 + (U_1 + dt*F(U_1))/4, U_3 = U_0/3 + 2/3*(U_2 + dt*F(U_2)).
constexpr StageRow shu_osher_3[] = {{0, 0, 0, 1, 1}, {1, 1, 0, 1, 4, 4, {{{1, 0}}}}, {0.5, 2, 2, 2, 3, 3, {{{0, 2}}}}};
/// SSPRK(4,3) of Kraaijevanger 1991, of Euler steps of dt/2: U_3 = 2/3*U_0 + (U_2 + dt/2*F(U_2))/3.
constexpr StageRow kraaijevanger[] = {
    {0, 0, 0, 1, 2}, {0.5, 1, 1, 1, 2}, {1, 2, 0, 1, 6, 3, {{{2, 0}}}}, {0.5, 3, 3, 1, 2}};
/// The mean of all four right-hand sides, of order 2 (Conde, Fekete and Shadid 2018, arXiv 1806.08693).
constexpr StageRow kraaijevanger_embedded = {0.5, 3, 0, 1, 4, 1, {{{3, 0, 1.5}}}};

/// Bogacki and Shampine 1989. The right-hand sides are recovered from the states: dt*F(U_0) = 2*(U_1 - U_0), and so on.
constexpr StageRow bogacki_shampine[] = {
    {0, 0, 0, 1, 2}, {0.5, 1, 0, 3, 4}, {0.75, 2, 0, 4, 9, 9, {{{1, 0, 4}, {2, 0, 4}}}}};
/// The result of order 2; U_3 is the one of order 3.
constexpr StageRow bogacki_shampine_embedded = {1, 3, 0, 1, 8, 4, {{{1, 0}, {3, 0, 3}}}};
/// Dormand and Prince 1980, in the same form; U_6 is the result of order 5.
constexpr StageRow dormand_prince[] = {
    {0, 0, 0, 1, 5},
    {0.2, 1, 0, 9, 40, 8, {{{1, 0, 3}}}},
    {0.3, 2, 0, 32, 9, 27, {{{1, 0, 300}, {2, 0, -448}}}},
    {0.8, 3, 0, -212, 729, 6561, {{{1, 0, 22260}, {2, 0, -37376}, {3, 0, 18126}}}},
    {8.0 / 9,
     4,
     0,
     -5103,
     18656,
     1,
     {{{1, 0, 424025.0 / 55968}, {2, 0, -61400.0 / 5247}, {3, 0, 96075.0 / 18656}, {4, 0, -35721.0 / 37312}}}},
    {1,
     5,
     0,
     11,
     84,
     1,
     {{{1, 0, -575.0 / 252},
       {2, 0, 31400.0 / 10017},
       {3, 0, 325.0 / 1344},
       {4, 0, -7533.0 / 6784},
       {5, 0, 33.0 / 28}}}}};
/// The result of order 4.
constexpr StageRow dormand_prince_embedded = {1,
                                              6,
                                              0,
                                              1,
                                              40,
                                              1,
                                              {{{1, 0, 41.0 / 180},
                                                {2, 0, -4294.0 / 10017},
                                                {3, 0, 263.0 / 384},
                                                {4, 0, -137781.0 / 339200},
                                                {5, 0, 803.0 / 4200},
                                                {6, 0, 17.0 / 25}}}};

// Numbers in brackets are sections of Ascher, Ruuth and Spiteri 1997.
constexpr AdditiveRow ars111[] = {{1, {1}}};
/// (2.6): L-stable of order 2 with g = 1 - 1/sqrt(2), and d = 1 - 1/(2*g) = -1/sqrt(2).
constexpr AdditiveWeight root = 0.707106781186547524400844L;
constexpr AdditiveRow ars222[] = {{1 - root, {1 - root}}, {1, {-root, 1 + root}, {root}}};
/// (2.8): L-stable of order 3.
constexpr AdditiveRow ars443[] = {{1.L / 2, {1.L / 2}},
                                  {2.L / 3, {11.L / 18, 1.L / 18}, {1.L / 6}},
                                  {1.L / 2, {5.L / 6, -5.L / 6, 1.L / 2}, {-1.L / 2, 1.L / 2}},
                                  {1, {1.L / 4, 7.L / 4, 3.L / 4, -7.L / 4}, {3.L / 2, -3.L / 2, 1.L / 2}}};
/// Derived for dpde, of order 2: u + h*(5/2*(N + L)(U_1) - 3/2*(N + L)(U_3)), both stages in the middle of the step.
/// These weights follow from the condition that a stiff L is damped as in the result, 1 = sum of w_j*(A^-1*(1, 1, 1,
/// 1))_j; otherwise the error estimate would not vanish with h. The conditions of order 3 fail by 1/12 (sum of
/// w_j*c_j^2 = 1/3) and by 1/24 (sum of w_j*(A*c)_j = 1/6), with the a_ij of N and of L.
constexpr AdditiveRow ars443_embedded = {1, {0, 5.L / 2, 0, -3.L / 2}, {5.L / 2, 0, -3.L / 2, 0}};

constexpr AdamsRow adams_bashforth_2[] = {{1}, {1.5, -0.5}};
/// The second step, after an Euler step, turns both into the midpoint rule over two steps: the start leaves an error of
/// dt^3.
constexpr AdamsRow adams_bashforth_3[] = {{1}, {2, -1}, {23.0 / 12, -16.0 / 12, 5.0 / 12}};

using enum TimeMethod::Family;

constexpr TimeMethod methods[] = {
    {.name = "euler", .family = runge_kutta, .order = 1, .stages = euler, .ssp_coefficient = 1},
    {.name = "rk2", .family = runge_kutta, .order = 2, .stages = midpoint_rule},
    {.name = "rk4", .family = runge_kutta, .order = 4, .stages = runge_kutta_4},
    {.name = "ssp_rk3", .family = runge_kutta, .order = 3, .stages = shu_osher_3, .ssp_coefficient = 1},
    {.name = "ssp_rk43",
     .family = runge_kutta,
     .order = 3,
     .stages = kraaijevanger,
     .embedded = &kraaijevanger_embedded,
     .order_of_estimate = 3,
     .ssp_coefficient = 2},
    {.name = "bs32",
     .family = runge_kutta,
     .order = 3,
     .stages = bogacki_shampine,
     .embedded = &bogacki_shampine_embedded,
     .order_of_estimate = 3},
    {.name = "dopri5",
     .family = runge_kutta,
     .order = 5,
     .stages = dormand_prince,
     .embedded = &dormand_prince_embedded,
     .order_of_estimate = 5},
    {.name = "verlet", .family = verlet, .order = 2},
    {.name = "ab2", .family = adams_bashforth, .order = 2, .rates = adams_bashforth_2},
    {.name = "ab3", .family = adams_bashforth, .order = 3, .rates = adams_bashforth_3},
    {.name = "leapfrog", .family = leapfrog, .order = 2},
    {.name = "etdrk2", .family = exponential, .order = 2},
    {.name = "etdrk4", .family = exponential, .order = 4},
    {.name = "backward_euler", .family = additive, .order = 1, .additive = {1, ars111}},
    {.name = "crank_nicolson", .family = trapezoidal, .order = 2},
    {.name = "imex_euler", .family = additive, .order = 1, .additive = {1, ars111}},
    {.name = "ars222", .family = additive, .order = 2, .additive = {1 - root, ars222}},
    {.name = "ars443",
     .family = additive,
     .order = 3,
     .additive = {1.L / 2, ars443, &ars443_embedded},
     .order_of_estimate = 3},
};

}  // namespace

std::span<const TimeMethod> time_methods() { return methods; }

TimeScheme find_time_method(std::string_view name) {
  const auto* const found = std::ranges::find(methods, name, &TimeMethod::name);
  return found == std::end(methods) ? nullptr : found;
}

TimeScheme time_method(std::string_view name) {
  const TimeScheme found = find_time_method(name);
  require(found != nullptr, "a method of the table");
  return found;
}

}  // namespace dpde::model
