// SPDX-License-Identifier: Apache-2.0
// The registry: everything the compiler and the command may ever complain about. One row a kind.
// E01xx characters, E02xx syntax, E03xx names and types, E04xx grid, boundary and time, E05xx schemes,
// E06xx derivatives, E07xx tasks and data, E08xx runs, E09xx files and machine, W0xxx warnings.
// Messages: lower case, one sentence, no stop, the user's words. tests/diagnostics triggers every row.
#pragma once

#include <string_view>

namespace dpde {

enum class Severity { warning, error };

struct DiagnosticKind {
  std::string_view code;
  std::string_view name;
  Severity severity;
  std::string_view message;
};

inline constexpr DiagnosticKind diagnostic_kinds[] = {
    {"E0101", "unexpected-character", Severity::error, "unexpected character {}"},
    {"E0102", "unterminated-text", Severity::error, "text without a closing quote"},
    {"E0103", "bad-number", Severity::error, "number {} is out of range"},
    {"E0104", "file-too-large", Severity::error, "the file has {} bytes, more than the 4194304 that are read"},
    {"E0201", "unexpected", Severity::error, "expected {} but found {}"},
    {"E0202", "unknown-declaration", Severity::error, "{} does not begin a block"},
    {"E0203", "unknown-item", Severity::error, "{} is not understood in a {}"},
    {"E0204", "nesting-too-deep", Severity::error, "the expression has too many parts inside one another"},
    {"E0205", "unclosed-block", Severity::error, "the {} has no closing }"},
    {"E0206", "chained-comparison", Severity::error, "comparisons cannot follow one another"},
    {"E0207", "unknown-option", Severity::error, "{} is not an option of {}"},
    {"E0208", "not-whole", Severity::error, "expected a whole number but found {}"},
    {"E0209", "not-an-equation", Severity::error, "an equation begins with dt(field), not with {}"},
    {"E0210", "bad-role", Severity::error, "{} can stand only before a {}"},
    {"E0211", "repeated", Severity::error, "{} is written twice"},
    {"E0301", "unknown-name", Severity::error, "{} is not known here"},
    {"E0302", "unknown-function", Severity::error, "there is no function called {}"},
    {"E0303", "duplicate", Severity::error, "{} is given twice"},
    {"E0304", "reserved-name", Severity::error, "{} has a meaning of its own and cannot name a {}"},
    {"E0305", "wrong-argument-count", Severity::error, "{} takes {}, not {}"},
    {"E0306", "not-a-function", Severity::error, "{} is a {}, not a function"},
    {"E0307", "not-a-number", Severity::error, "expected a number but this is a {}"},
    {"E0308", "not-a-condition", Severity::error, "expected a condition but this is a {}"},
    {"E0309", "wrong-length", Severity::error, "expected {} but this has {}"},
    {"E0310", "function-without-arguments", Severity::error, "{} is a function and needs its arguments"},
    {"E0311", "not-allowed-here", Severity::error, "{} cannot appear in {}"},
    {"E0312", "missing-equation", Severity::error, "field {} has no equation"},
    {"E0313", "not-a-field", Severity::error, "{} is a {}; only a field has {}"},
    {"E0314", "missing-value", Severity::error, "{} {} has no value"},
    {"E0315", "used-before-value", Severity::error, "{} has no value yet at this place"},
    {"E0316", "not-finite", Severity::error, "this is not a finite number: {}"},
    {"E0317", "too-large", Severity::error, "the expression is too large once its lets and operators are spelled out"},
    {"E0318", "unknown-block", Severity::error, "there is no {} called {}"},
    {"E0319", "choose-one", Severity::error, "the file has several {}"},
    {"E0320", "no-scene", Severity::error, "the file has no scene"},
    {"E0321", "missing-axis", Severity::error, "the scene has no axis {}"},
    {"E0322", "wrong-order", Severity::error, "a derivative has order 1, 2, 3 or 4, not {}"},
    {"E0323", "vector-operation", Severity::error, "{} is not defined for {}"},
    {"E0324", "no-state", Severity::error, "program {} swaps no fields and so makes no step"},
    {"E0325", "not-a-value", Severity::error, "{} is a {} and takes no value here"},
    {"E0326", "no-field", Severity::error, "model {} has no field"},
    {"E0350", "kernel-unknown-name", Severity::error, "{} is not a parameter or let of kernel {}"},
    {"E0351", "kernel-unknown-function", Severity::error, "{} is not a function that kernels can call"},
    {"E0352", "kernel-argument-count", Severity::error, "{} takes {} arguments, not {}"},
    {"E0353", "kernel-offset-count", Severity::error, "{} has {} offsets, but kernel {} has {}"},
    {"E0354", "kernel-wrong-role", Severity::error, "{} is a {} and cannot be used as a {}"},
    {"E0355", "kernel-race", Severity::error, "kernel {} writes {}, which it also reads"},
    {"E0356", "kernel-not-written", Severity::error, "{} is declared {} but kernel {} does not write it"},
    {"E0357", "kernel-wrong-assignment", Severity::error, "{} is a {} and is written with {}"},
    {"E0358", "kernel-halo-too-small", Severity::error, "{} is read {} cells away, but its halo is {}"},
    {"E0359", "name-taken", Severity::error, "{} is already the name of {}"},
    {"E0360", "not-in-kernels", Severity::error, "{} cannot stand in a kernel or program"},
    {"E0361", "unknown-kernel", Severity::error, "there is no kernel {}"},
    {"E0362", "unknown-program", Severity::error, "there is no program {}"},
    {"E0363", "program-unknown-field", Severity::error, "no kernel that program {} runs has a field {}"},
    {"E0364", "program-result-not-written", Severity::error, "program {} does not write {}"},
    {"E0365", "program-axes", Severity::error, "program {} has {}, but {} has {}"},
    {"E0366", "fill-incomplete", Severity::error, "the {} of {} says nothing about {}"},
    {"E0367", "boundary-value-varies", Severity::error, "{} is a field, but the values of a {} are made of params and numbers"},
    {"E0368", "bad-program", Severity::error, "{}"},
    {"E0369", "program-without-result", Severity::error, "program {} has no result"},
    {"E0370", "distance-out-of-range", Severity::error, "{} cells is not a distance between {} and {}"},
    {"E0401", "missing-grid", Severity::error, "scene {} has no grid"},
    {"E0402", "unknown-axis", Severity::error, "{} is not an axis"},
    {"E0403", "axes-not-in-order", Severity::error, "a grid with axis {} needs axis {} too"},
    {"E0404", "missing-cells", Severity::error, "axis {} has no number of cells"},
    {"E0405", "bad-cells", Severity::error, "the number of cells is a whole number from 1 to 2147483647, not {}"},
    {"E0406", "too-many-cells", Severity::error, "the grid has {} cells, more than 2147483648"},
    {"E0407", "empty-extent", Severity::error, "the axis must end behind its begin {}, not at {}"},
    {"E0408", "missing-boundary", Severity::error, "field {} has no boundary at {}"},
    {"E0409", "boundary-of-periodic-axis", Severity::error, "axis {} is periodic and takes no boundary"},
    {"E0410", "unknown-side", Severity::error, "{} is not a side of the grid"},
    {"E0411", "missing-initial", Severity::error, "field {} has no initial state"},
    {"E0412", "missing-time", Severity::error, "scene {} does not say how long it runs"},
    {"E0413", "missing-step", Severity::error, "scene {} has no time step"},
    {"E0414", "bad-step", Severity::error, "the time step must be positive, not {}"},
    {"E0415", "bad-duration", Severity::error, "the run must end after its begin {}, not at {}"},
    {"E0416", "uneven-steps", Severity::error, "from {} to {} is not a whole number of steps of {}"},
    {"E0417", "too-many-steps", Severity::error, "the run has {} steps, more than 2147483647"},
    {"E0418", "time-off-step", Severity::error, "no step of the run ends at t = {}"},
    {"E0419", "fill-differs", Severity::error, "program {} fills {} as {} along {}, but the grid there is {}"},
    {"E0420", "boundary-of-program", Severity::error, "the boundaries of {} are those of the fills of program {}"},
    {"E0421", "rank-differs", Severity::error, "kernel {} works on {} but the scene has {}"},
    {"E0501", "unknown-scheme-key", Severity::error, "{} is not a key of a scheme"},
    {"E0502", "bad-scheme-value", Severity::error, "{} cannot be {}"},
    {"E0503", "precision-not-available", Severity::error, "real = {} is not available"},
    {"E0504", "unknown-setting", Severity::error, "there is nothing called {} to set"},
    {"E0505", "bad-setting", Severity::error, "{} cannot be set to {}: {}"},
    {"E0551", "advection-form", Severity::error, "semi-Lagrangian advection of {} needs one term -advect(v, {}) of its equation"},
    {"E0552", "too-many-differences", Severity::error, "the differences of this expression have more than {} parts"},
    {"E0701", "incomplete-task", Severity::error, "task {} has nothing to {}"},
    {"E0702", "not-an-unknown", Severity::error, "{} is a {} and cannot be an unknown"},
    {"E0703", "bad-data", Severity::error, "data come from a file or from the field of a scene, not from this"},
    {"E0704", "no-such-field", Severity::error, "scene {} has no field {}"},
    {"E0705", "not-reduced", Severity::error, "{} is not a sum of mean, sum or integral with constant factors"},
    {"E0706", "unknown-optimiser", Severity::error, "there is no optimiser called {}"},
    {"E0707", "bad-optimiser-option", Severity::error, "{} of {} {}"},
    {"E0708", "bad-iterations", Severity::error, "iterations is a whole number from 1 on, not {}"},
    {"E0709", "unknown-in-number", Severity::error, "unknown {} cannot appear in {}"},
    {"E0710", "bad-load", Severity::error, "load takes the name of one file"},
    {"W0301", "unused-parameter", Severity::warning, "parameter {} is not used"},
    {"E0801", "blow-up", Severity::error, "{} is no longer finite after step {} of {} (t = {}), first in cell ({}) at {}"},
    {"E0802", "interrupted", Severity::error, "stopped after step {} of {} (t = {})"},
    {"E0803", "loss-not-finite", Severity::error, "the loss is {} at iteration {}"},
    {"E0804", "verification-failed", Severity::error, "derivative of {} not certified: {}"},
    {"E0805", "start-not-finite", Severity::error, "the initial state of {} is not finite in cell ({}) at {}"},
    {"E0806", "optimiser-interrupted", Severity::error, "stopped after iteration {} of {}"},
    {"E0807", "run-failed", Severity::error, "{}"},
    {"E0901", "cannot-read", Severity::error, "cannot read {}: {}"},
    {"E0902", "cannot-write", Severity::error, "cannot write {}: {}"},
    {"E0903", "machine-failed", Severity::error, "{}"},
    {"E0904", "bad-option", Severity::error, "{}"},
    {"E0905", "wrong-shape", Severity::error, "{} holds values of shape {}, but {} needs {}"},
    {"E0906", "data-not-finite", Severity::error, "{} holds {} at index {}"},
    {"E0907", "bad-array-file", Severity::error, "{} cannot be used: {}"},
    {"E0908", "nothing-to-do", Severity::error, "{}"},
    {"E0909", "data-of-other-scene", Severity::error, "cannot compare with scene {}: {}"},
    {"E0910", "broken-invariant", Severity::error, "the {} level is broken: {} (this is a bug of dpde)"},
    {"E0911", "broken-program", Severity::error, "the hand-written program cannot be run: {}"},
    {"E0912", "data-without-time", Severity::error, "{} holds no state at t = {}"},
    {"E0913", "unknown-in-coefficient", Severity::error, "unknown {} appears in the formula of coefficient {}"},
    {"E0601", "no-useful-derivative", Severity::error, "{} in kernel {} has no derivative that is of use"},
    {"E0602", "accumulates-onto-read-field", Severity::error, "kernel {} reads field {} and adds to it"},
    {"E0603", "overwritten-value", Severity::error, "the derivative of kernel {} needs field {} as it was before it is changed again"},
    {"E0604", "varied-boundary-value", Severity::error, "a boundary value of field {} depends on an unknown"},
    {"E0605", "unknown-in-boundary", Severity::error, "unknown {} appears in a boundary value of {}"},
};

/// The row called `name`; a name that is not in the table does not compile.
consteval const DiagnosticKind* find_kind(std::string_view name) {
  for (const DiagnosticKind& kind : diagnostic_kinds) {
    if (kind.name == name) return &kind;
  }
  throw "no diagnostic kind of this name";
}

}  // namespace dpde
