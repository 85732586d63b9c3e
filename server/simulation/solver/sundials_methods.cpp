// The only file that uses SUNDIALS (7.1 or 6.4, Lawrence Livermore National Laboratory): CVODE, ARKODE and
// IDA behind AdaptiveMethod. The problem itself solves the linear systems, whose matrix has blocks, through
// an empty SUNMatrix and an own SUNLinearSolver.
#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "server/simulation/solver/adaptive_method.h"

namespace takt {

namespace {

// The code uses the names of SUNDIALS 7; the differing names of 6 follow.
#if SUNDIALS_VERSION_MAJOR < 7
constexpr void* SUN_COMM_NULL = nullptr;
constexpr auto ARKodeEvolve = ARKStepEvolve;
constexpr auto ARKodeFree = ARKStepFree;
constexpr auto ARKodeGetLastStep = ARKStepGetLastStep;
constexpr auto ARKodeGetNonlinSolvStats = ARKStepGetNonlinSolvStats;
constexpr auto ARKodeGetNumErrTestFails = ARKStepGetNumErrTestFails;
constexpr auto ARKodeGetNumSteps = ARKStepGetNumSteps;
constexpr auto ARKodeRootInit = ARKStepRootInit;
constexpr auto ARKodeWFtolerances = ARKStepWFtolerances;
constexpr auto ARKodeSetDeduceImplicitRhs = ARKStepSetDeduceImplicitRhs;
constexpr auto ARKodeSetDeltaGammaMax = ARKStepSetDeltaGammaMax;
constexpr auto ARKodeSetInitStep = ARKStepSetInitStep;
constexpr auto ARKodeSetLinSysFn = ARKStepSetLinSysFn;
constexpr auto ARKodeSetLinearSolver = ARKStepSetLinearSolver;
constexpr auto ARKodeSetMaxHnilWarns = ARKStepSetMaxHnilWarns;
constexpr auto ARKodeSetNoInactiveRootWarn = ARKStepSetNoInactiveRootWarn;
constexpr auto ARKodeSetFixedStepBounds = ARKStepSetFixedStepBounds;
constexpr auto ARKodeSetNonlinCRDown = ARKStepSetNonlinCRDown;
constexpr auto ARKodeSetRootDirection = ARKStepSetRootDirection;
constexpr auto ARKodeSetStopTime = ARKStepSetStopTime;
constexpr auto ARKodeSetUserData = ARKStepSetUserData;
#endif

// Return values of callbacks: 0 good, > 0 try a smaller step, < 0 give up.
constexpr int kGood = 0, kRecoverable = 1, kBroken = -1;

// ARKODE carries its estimate of Newton's rate of convergence from step to step. After an exact matrix the
// estimate is so small that one iteration passes as convergence; with a step changed by up to 20 % and the
// old factors that is wrong (an oscillator at tolerance 1e-8 has an error of 1e-3). So the estimate never
// improves, and a changed step gets new factors, which are cheap here.
constexpr double kGammaChange = 1e-3;

struct System {
  AdaptiveProblem* problem = nullptr;
  double a = 1.0, b = 0.0;  // the matrix is a I - b J
};

System& of(void* user_data) {
  return *static_cast<System*>(user_data);
}

// Return code of a callback for a successful or failed evaluation.
int code(const AdaptiveProblem& problem, bool good) {
  if (good) return kGood;
  return problem.thrown().empty() ? kRecoverable : kBroken;
}

int right_side(sunrealtype t, N_Vector x, N_Vector xdot, void* user_data) {
  AdaptiveProblem& problem = *of(user_data).problem;
  return code(problem, problem.derivatives(t, N_VGetArrayPointer(x), N_VGetArrayPointer(xdot)));
}

int residual(sunrealtype t, N_Vector x, N_Vector xdot, N_Vector r, void* user_data) {
  AdaptiveProblem& problem = *of(user_data).problem;
  double* values = N_VGetArrayPointer(r);
  if (!problem.derivatives(t, N_VGetArrayPointer(x), values)) return code(problem, false);
  const double* rates = N_VGetArrayPointer(xdot);
  for (sunindextype i = 0; i < N_VGetLength(r); ++i) values[i] = rates[i] - values[i];
  return kGood;
}

int crossings(sunrealtype t, N_Vector x, sunrealtype* g, void* user_data) {
  // Any other value ends the step as failed.
  return of(user_data).problem->indicators(t, N_VGetArrayPointer(x), g) ? kGood : kBroken;
}

int crossings_ida(sunrealtype t, N_Vector x, N_Vector, sunrealtype* g, void* user_data) {
  return crossings(t, x, g, user_data);
}

// SUNDIALS 6 reports errors by solver, SUNDIALS 7 by context.
#if SUNDIALS_VERSION_MAJOR < 7
void error_text(int code, const char*, const char* function, char* text, void* user_data) {
  if (code < 0) of(user_data).problem->report(std::string(function) + ": " + text);  // else a warning
}
bool context_reports(SUNContext, System&) {
  return true;
}
template <auto set_handler>
bool reports(void* memory, System& system) {
  return set_handler(memory, error_text, &system) == 0;
}
constexpr auto cvode_reports = reports<CVodeSetErrHandlerFn>;
constexpr auto arkode_reports = reports<ARKStepSetErrHandlerFn>;
constexpr auto ida_reports = reports<IDASetErrHandlerFn>;
#else
void error_text(int, const char* function, const char*, const char* text, SUNErrCode code, void* user_data,
                SUNContext) {
  if (code < 0) of(user_data).problem->report(std::string(function) + ": " + (text ? text : "failed"));
}
bool context_reports(SUNContext context, System& system) {
  return SUNContext_ClearErrHandlers(context) == 0 &&
         SUNContext_PushErrHandler(context, error_text, &system) == 0;
}
bool reports(void*, System&) {
  return true;
}
constexpr auto cvode_reports = reports, arkode_reports = reports, ida_reports = reports;
#endif

int error_weights(N_Vector x, N_Vector weights, void* user_data) {
  of(user_data).problem->error_weights(N_VGetArrayPointer(x), N_VGetArrayPointer(weights));
  return kGood;
}

int linear_system(sunrealtype t, N_Vector x, N_Vector f, SUNMatrix, sunbooleantype keep,
                  sunbooleantype* fresh, sunrealtype gamma, void* user_data, N_Vector, N_Vector, N_Vector) {
  System& system = of(user_data);
  *fresh = keep ? SUNFALSE : SUNTRUE;
  system.a = 1.0, system.b = gamma;
  if (keep) return kGood;
  return code(*system.problem,
              system.problem->evaluate_jacobian(t, N_VGetArrayPointer(x), N_VGetArrayPointer(f)));
}

int linear_system_arkode(sunrealtype t, N_Vector x, N_Vector f, SUNMatrix A, SUNMatrix, sunbooleantype keep,
                         sunbooleantype* fresh, sunrealtype gamma, void* user_data, N_Vector t1, N_Vector t2,
                         N_Vector t3) {
  return linear_system(t, x, f, A, keep, fresh, gamma, user_data, t1, t2, t3);
}

int jacobian_ida(sunrealtype t, sunrealtype cj, N_Vector x, N_Vector xdot, N_Vector r, SUNMatrix,
                 void* user_data, N_Vector f, N_Vector, N_Vector) {
  System& system = of(user_data);
  system.a = cj, system.b = 1.0;
  N_VLinearSum(1.0, xdot, -1.0, r, f);
  return code(*system.problem,
              system.problem->evaluate_jacobian(t, N_VGetArrayPointer(x), N_VGetArrayPointer(f)));
}

// Serial vectors whose norm is that of the problem. What SUNDIALS does with serial vectors sees the first member.
struct ProblemVector {
  _N_VectorContent_Serial serial;
  const AdaptiveProblem* problem;
};

const AdaptiveProblem* problem_of(N_Vector v) {
  return static_cast<const ProblemVector*>(v->content)->problem;
}

N_Vector with_problem(N_Vector serial, const AdaptiveProblem* problem) {
  if (serial == nullptr) return nullptr;
  auto* content = static_cast<ProblemVector*>(std::malloc(sizeof(ProblemVector)));  // SUNDIALS frees it
  if (content == nullptr) {
    N_VDestroy_Serial(serial);
    return nullptr;
  }
  *content = {*static_cast<N_VectorContent_Serial>(serial->content), problem};
  std::free(serial->content);
  serial->content = content;
  serial->ops->nvclone = [](N_Vector v) { return with_problem(N_VClone_Serial(v), problem_of(v)); };
  serial->ops->nvcloneempty = [](N_Vector v) { return with_problem(N_VCloneEmpty_Serial(v), problem_of(v)); };
  serial->ops->nvwrmsnorm = [](N_Vector errors, N_Vector weights) {
    return problem_of(errors)->error_norm(N_VGetArrayPointer(errors), N_VGetArrayPointer(weights));
  };
  return serial;
}

// The matrix lives in the problem; SUNDIALS holds an empty shell of it.
SUNMatrix empty_matrix(SUNContext context) {
  SUNMatrix A = SUNMatNewEmpty(context);
  if (A == nullptr) return nullptr;
  A->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
  A->ops->zero = [](SUNMatrix) { return 0; };
  A->ops->destroy = [](SUNMatrix matrix) { SUNMatFreeEmpty(matrix); };
  return A;
}

SUNLinearSolver block_solver(SUNContext context, System& system) {
  SUNLinearSolver solver = SUNLinSolNewEmpty(context);
  if (solver == nullptr) return nullptr;
  solver->content = &system;
  solver->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
  solver->ops->getid = [](SUNLinearSolver) { return SUNLINEARSOLVER_CUSTOM; };
  solver->ops->setup = [](SUNLinearSolver s, SUNMatrix) {
    const System& matrix = of(s->content);
    return matrix.problem->factorise(matrix.a, matrix.b) ? kGood : kRecoverable;
  };
  solver->ops->solve = [](SUNLinearSolver s, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
    N_VScale(1.0, b, x);
    of(s->content).problem->solve(N_VGetArrayPointer(x));
    return kGood;
  };
  solver->ops->free = [](SUNLinearSolver s) {
    s->content = nullptr;
    SUNLinSolFreeEmpty(s);
    return 0;
  };
  return solver;
}

class SundialsMethod : public AdaptiveMethod {
 public:
  explicit SundialsMethod(AdaptiveProblem& problem) : system_{&problem} {
    require(SUNContext_Create(SUN_COMM_NULL, &context_) == 0 && context_reports(context_, system_),
            "a context");
    x_ = with_problem(N_VNew_Serial(problem.state_count(), context_), &problem);
    matrix_ = empty_matrix(context_);
    solver_ = block_solver(context_, system_);
    require(x_ && matrix_ && solver_, "memory");
    N_VConst(0.0, x_);
    down_.assign(static_cast<std::size_t>(problem.indicator_count()), -1);
  }
  SundialsMethod(const SundialsMethod&) = delete;
  SundialsMethod& operator=(const SundialsMethod&) = delete;
  ~SundialsMethod() override {
    if (solver_ != nullptr) SUNLinSolFree(solver_);
    if (matrix_ != nullptr) SUNMatDestroy(matrix_);
    if (x_ != nullptr) N_VDestroy(x_);
    if (context_ != nullptr) SUNContext_Free(&context_);
  }
  std::span<const double> state() const override {
    return {N_VGetArrayPointer(x_), static_cast<std::size_t>(N_VGetLength(x_))};
  }

 protected:
  static void require(bool good, const char* what) {
    if (!good) throw std::runtime_error(std::string("SUNDIALS gave no ") + what);
  }
  // The codes of the three libraries agree: 0 success, 1 at the stop time, 2 at a crossing. A success with a
  // reported error counts as a failure: ARKODE 5.4 returns success if its interpolation at the stop time
  // failed, with an invalid state.
  Outcome outcome(int code) {
    static_assert(CV_TSTOP_RETURN == 1 && ARK_TSTOP_RETURN == 1 && IDA_TSTOP_RETURN == 1);
    static_assert(CV_ROOT_RETURN == 2 && ARK_ROOT_RETURN == 2 && IDA_ROOT_RETURN == 2);
    if (code < 0 || !problem().message().empty()) return Outcome::failed;
    return code == CV_ROOT_RETURN ? Outcome::crossing : Outcome::stepped;
  }
  void set_state(std::span<const double> x) { std::copy(x.begin(), x.end(), N_VGetArrayPointer(x_)); }
  AdaptiveProblem& problem() { return *system_.problem; }

  System system_;
  SUNContext context_ = nullptr;
  N_Vector x_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver solver_ = nullptr;
  std::vector<int> down_;  // crossings count from positive to negative only
};

/// Backward differentiation formulas of order 1 to 5, Newton's method.
class Cvode final : public SundialsMethod {
 public:
  explicit Cvode(AdaptiveProblem& p) : SundialsMethod(p), memory_(CVodeCreate(CV_BDF, context_)) {
    require(memory_ != nullptr, "CVODE");
    const bool good =
        CVodeInit(memory_, right_side, 0.0, x_) == 0 && CVodeSetUserData(memory_, &system_) == 0 &&
        cvode_reports(memory_, system_) && CVodeWFtolerances(memory_, error_weights) == 0 &&
        CVodeSetLinearSolver(memory_, solver_, matrix_) == 0 &&
        CVodeSetLinSysFn(memory_, linear_system) == 0 && CVodeSetMaxHnilWarns(memory_, -1) == 0 &&
        (down_.empty() ||
         (CVodeRootInit(memory_, p.indicator_count(), crossings) == 0 &&
          CVodeSetRootDirection(memory_, down_.data()) == 0 && CVodeSetNoInactiveRootWarn(memory_) == 0));
    require(good, "CVODE with these settings");
  }
  ~Cvode() override { CVodeFree(&memory_); }
  bool start(double t, std::span<const double> x, double first_step_s) override {
    set_state(x);
    return CVodeReInit(memory_, t, x_) == 0 && CVodeSetInitStep(memory_, first_step_s) == 0;
  }
  Outcome step(double t_stop, double& t) override {
    problem().clear_message();
    if (CVodeSetStopTime(memory_, t_stop) != 0) return Outcome::failed;
    return outcome(CVode(memory_, t_stop, x_, &t, CV_ONE_STEP));
  }
  double last_step_s() const override {
    double h = 0.0;
    CVodeGetLastStep(memory_, &h);
    return h;
  }
  Counts counts() const override {
    Counts c;
    CVodeGetNumSteps(memory_, &c.steps);
    CVodeGetNumErrTestFails(memory_, &c.rejected);
    CVodeGetNonlinSolvStats(memory_, &c.newton_iterations, &c.newton_failures);
    return c;
  }

 private:
  void* memory_;
};

/// Singly diagonally implicit Runge-Kutta with an explicit first stage (Kennedy and Carpenter 2016, 2019),
/// L-stable, stiffly accurate.
class Esdirk final : public SundialsMethod {
 public:
  Esdirk(AdaptiveProblem& p, ARKODE_DIRKTableID table) : SundialsMethod(p) {
    memory_ = ARKStepCreate(nullptr, right_side, 0.0, x_, context_);
    require(memory_ != nullptr, "ARKODE");
    const bool good =
        ARKodeSetUserData(memory_, &system_) == 0 && arkode_reports(memory_, system_) &&
        ARKStepSetTableNum(memory_, table, ARKODE_ERK_NONE) == 0 &&
        ARKodeWFtolerances(memory_, error_weights) == 0 &&
        ARKodeSetLinearSolver(memory_, solver_, matrix_) == 0 &&
        ARKodeSetLinSysFn(memory_, linear_system_arkode) == 0 && ARKodeSetNonlinCRDown(memory_, 1.0) == 0 &&
        ARKodeSetDeltaGammaMax(memory_, kGammaChange) == 0 && ARKodeSetMaxHnilWarns(memory_, -1) == 0 &&
        ARKodeSetDeduceImplicitRhs(memory_, SUNTRUE) == 0 &&
        ARKodeSetFixedStepBounds(memory_, 1.0, 1.05) == 0 &&
        (down_.empty() ||
         (ARKodeRootInit(memory_, p.indicator_count(), crossings) == 0 &&
          ARKodeSetRootDirection(memory_, down_.data()) == 0 && ARKodeSetNoInactiveRootWarn(memory_) == 0));
    require(good, "ARKODE with these settings");
  }
  ~Esdirk() override { ARKodeFree(&memory_); }
  bool start(double t, std::span<const double> x, double first_step_s) override {
    set_state(x);
    return ARKStepReInit(memory_, nullptr, right_side, t, x_) == 0 &&
           ARKodeSetInitStep(memory_, first_step_s) == 0;
  }
  Outcome step(double t_stop, double& t) override {
    problem().clear_message();
    if (ARKodeSetStopTime(memory_, t_stop) != 0) return Outcome::failed;
    return outcome(ARKodeEvolve(memory_, t_stop, x_, &t, ARK_ONE_STEP));
  }
  double last_step_s() const override {
    double h = 0.0;
    ARKodeGetLastStep(memory_, &h);
    return h;
  }
  Counts counts() const override {
    Counts c;
    ARKodeGetNumSteps(memory_, &c.steps);
    ARKodeGetNumErrTestFails(memory_, &c.rejected);
    ARKodeGetNonlinSolvStats(memory_, &c.newton_iterations, &c.newton_failures);
    return c;
  }

 private:
  void* memory_ = nullptr;
};

/// The successor of DASSL: F(t, x, x') = x' - f(t, x) = 0, BDF in fixed-leading-coefficient form.
class Ida final : public SundialsMethod {
 public:
  explicit Ida(AdaptiveProblem& p) : SundialsMethod(p), memory_(IDACreate(context_)) {
    xdot_ = N_VClone(x_);
    require(memory_ != nullptr && xdot_ != nullptr, "IDA");
    N_VConst(0.0, xdot_);
    const bool good =
        IDAInit(memory_, residual, 0.0, x_, xdot_) == 0 && IDASetUserData(memory_, &system_) == 0 &&
        ida_reports(memory_, system_) && IDAWFtolerances(memory_, error_weights) == 0 &&
        IDASetLinearSolver(memory_, solver_, matrix_) == 0 && IDASetJacFn(memory_, jacobian_ida) == 0 &&
        (down_.empty() ||
         (IDARootInit(memory_, p.indicator_count(), crossings_ida) == 0 &&
          IDASetRootDirection(memory_, down_.data()) == 0 && IDASetNoInactiveRootWarn(memory_) == 0));
    require(good, "IDA with these settings");
  }
  ~Ida() override {
    IDAFree(&memory_);
    if (xdot_ != nullptr) N_VDestroy(xdot_);
  }
  bool start(double t, std::span<const double> x, double first_step_s) override {
    set_state(x);
    return problem().derivatives(t, x.data(), N_VGetArrayPointer(xdot_)) &&
           IDAReInit(memory_, t, x_, xdot_) == 0 && IDASetInitStep(memory_, first_step_s) == 0;
  }
  Outcome step(double t_stop, double& t) override {
    problem().clear_message();
    if (IDASetStopTime(memory_, t_stop) != 0) return Outcome::failed;
    return outcome(IDASolve(memory_, t_stop, &t, x_, xdot_, IDA_ONE_STEP));
  }
  double last_step_s() const override {
    double h = 0.0;
    IDAGetLastStep(memory_, &h);
    return h;
  }
  Counts counts() const override {
    Counts c;
    IDAGetNumSteps(memory_, &c.steps);
    IDAGetNumErrTestFails(memory_, &c.rejected);
    IDAGetNonlinSolvStats(memory_, &c.newton_iterations, &c.newton_failures);
    return c;
  }

 private:
  void* memory_;
  N_Vector xdot_ = nullptr;
};

}  // namespace

std::unique_ptr<AdaptiveMethod> make_adaptive_method(std::string_view name, AdaptiveProblem& problem) {
  if (name == "cvode") return std::make_unique<Cvode>(problem);
  if (name == "esdirk") return std::make_unique<Esdirk>(problem, ARKODE_ESDIRK547L2SA2_7_4_5);
  if (name == "esdirk4") return std::make_unique<Esdirk>(problem, ARKODE_ESDIRK436L2SA_6_3_4);
  if (name == "ida") return std::make_unique<Ida>(problem);
  throw std::invalid_argument("unknown method '" + std::string(name) + "'");
}

}  // namespace takt
