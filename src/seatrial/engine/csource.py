"""Printing CasADi's flat instruction lists as C, one statement an instruction, inside a lane loop.

The printed code knows lanes and nothing else: the C compiler vectorises the loop, with the vector
mathematics of the C library.  Traps that shaped it: sin and cos of one argument would be fused
into sincos, which has no vector form (-fno-builtin); fmin/fmax as calls cost five times a select;
-ffast-math is not needed and would hide NaN.
"""

from __future__ import annotations

import math
from functools import cache

import casadi as ca

from ..core.symbolic import Function
from . import System
from .trace import Jacobian

LANES = 16
"""Lanes of a block: two vectors of AVX-512, four of AVX2; every array is padded to it."""

BINARY = {"OP_ADD": "+", "OP_SUB": "-", "OP_MUL": "*", "OP_DIV": "/"}
CALLS = ("sin", "cos", "exp", "log", "tanh", "asin", "acos", "atan", "atan2", "pow")
CALL = {f"OP_{name.upper()}": name for name in CALLS} | {"OP_FABS": "fabs", "OP_SQRT": "sqrt", "OP_CONSTPOW": "pow"}
FORM = {
    "OP_ASSIGN": "{0}", "OP_NEG": "-{0}", "OP_SQ": "{0}*{0}", "OP_TWICE": "{0}+{0}", "OP_INV": "1.0/{0}",
    "OP_LT": "({0}<{1}?1.0:0.0)", "OP_LE": "({0}<={1}?1.0:0.0)", "OP_EQ": "({0}=={1}?1.0:0.0)",
    "OP_NE": "({0}!={1}?1.0:0.0)", "OP_NOT": "({0}!=0.0?0.0:1.0)",
    "OP_AND": "({0}!=0.0&&{1}!=0.0?1.0:0.0)", "OP_OR": "({0}!=0.0||{1}!=0.0?1.0:0.0)",
    "OP_IF_ELSE_ZERO": "({0}!=0.0?{1}:0.0)", "OP_SIGN": "({0}>0.0?1.0:({0}<0.0?-1.0:0.0))",
    "OP_FMIN": "({0}<{1}?{0}:{1})", "OP_FMAX": "({0}>{1}?{0}:{1})",
}  # fmt: skip

HEADER = """#define V __attribute__((simd("notinbranch"),const))
V double sin(double); V double cos(double); V double exp(double); V double log(double);
V double tanh(double); V double asin(double); V double acos(double); V double atan(double);
V double atan2(double,double); V double pow(double,double);
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define INF __builtin_inf()
#define NAN_ __builtin_nan("")
#define LB 16
typedef const double* restrict in; typedef double* restrict out;
"""


@cache
def _opcodes() -> dict[int, str]:
    return {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}


def _constant(value: float) -> str:
    if math.isnan(value):
        return "NAN_"
    if math.isinf(value):
        return "INF" if value > 0 else "(-INF)"
    return f"({value!r})"


def statements(f: Function) -> tuple[list[str], set[tuple[int, int]]]:
    """C statements of `f`, and the (input, element) pairs they read as ``i<input>_<element>``."""
    names: dict[int, str] = {}
    lines: list[str] = []
    used: set[tuple[int, int]] = set()
    opcodes = _opcodes()
    for k in range(f.n_instructions()):
        op, to, of = opcodes[f.instruction_id(k)], f.instruction_output(k), f.instruction_input(k)
        if op == "OP_INPUT":
            used.add((of[0], of[1]))
            names[to[0]] = f"i{of[0]}_{of[1]}"
        elif op == "OP_CONST":
            names[to[0]] = _constant(f.instruction_constant(k))
        elif op == "OP_OUTPUT":
            lines.append(f"y[{to[1]}*LB+b]={names[of[0]]};")
        else:
            lines.append(f"const double w{k}={_expression(op, [names[i] for i in of])};")
            names[to[0]] = f"w{k}"
    return lines, used


def _expression(op: str, a: list[str]) -> str:
    if op in BINARY:
        return f"{a[0]}{BINARY[op]}{a[1]}"
    if op in CALL:
        return f"{CALL[op]}({','.join(a)})"
    return FORM[op].format(*a)


def lane_function(name: str, f: Function, arguments: tuple[str, ...], lanewise: dict[int, int]) -> str:
    """A C function over the lanes of one block.

    Args:
        name: its name in C.
        f: the CasADi function.
        arguments: kind of each input of `f`: "lane" (an array per lane), "scalar" (a double),
            or "parameters" (shared scalars `p`, of which some are lane-wise in `q`).
        lanewise: position in `q` of each lane-wise parameter by its index.
    """
    lines, used = statements(f)
    shared: list[str] = []
    loads: list[str] = []
    for i, j in sorted(used):
        kind = arguments[i]
        if kind == "lane":
            loads.append(f"const double i{i}_{j}=a{i}[{j}*LB+b];")
        elif kind == "scalar":
            shared.append(f"const double i{i}_{j}=a{i};")
        elif j in lanewise:
            loads.append(f"const double i{i}_{j}=q[{lanewise[j]}*LB+b];")
        else:
            shared.append(f"const double i{i}_{j}=p[{j}];")
    inputs = [f"in a{i}" if k == "lane" else f"double a{i}" for i, k in enumerate(arguments) if k != "parameters"]
    return (
        f"static void {name}({','.join(inputs)},in q,in p,out y){{\n{''.join(shared)}\n"
        "#pragma omp simd\nfor(long b=0;b<LB;b++){" + "".join(loads) + "\n" + "\n".join(lines) + "}}\n"
    )


ROLLOUT = """
void evaluate(long nb,in Z,in A,in Q,in P,out Y){for(long q=0;q<nb;q++)rhs(Z+q*NS*LB,A+q*NA*LB,Q+q*NQ*LB,P,Y+q*NS*LB);}
void rollout(long b0,long b1,long T,double t0,double dt,long every,long rk4,in Z0,in M0,in S,long sb,long st,in Q,in P,out Y,long rows){
for(long blk=b0;blk<b1;blk++){
 double z[NS*LB],w[NS*LB],k[NS*LB],g[NS*LB],y[NY*LB],m[NM1*LB];
 const double*q=Q+blk*NQ*LB; double*o=Y+blk*rows*NO*LB;
 for(long i=0;i<NS*LB;i++)z[i]=Z0[blk*NS*LB+i];
 for(long i=0;i<NM*LB;i++)m[i]=M0[blk*NM*LB+i];
 for(long t=0;t<T;t++){
  const double*s=S+blk*sb+t*st;
  PREPARE
  if(t%every==0){for(long i=0;i<NS*LB;i++)o[i]=z[i]; for(long i=0;i<NM*LB;i++)o[NS*LB+i]=m[i];
   for(long i=0;i<NL*LB;i++)o[(NS+NM)*LB+i]=y[(NA+NM)*LB+i]; o+=NO*LB;}
  if(t==T-1)break;
  rhs(z,a,q,P,k);
  if(rk4){
   for(long i=0;i<NS*LB;i++){g[i]=k[i];w[i]=z[i]+0.5*dt*k[i];} rhs(w,a,q,P,k);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*k[i];w[i]=z[i]+0.5*dt*k[i];} rhs(w,a,q,P,k);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*k[i];w[i]=z[i]+dt*k[i];} rhs(w,a,q,P,k);
   for(long i=0;i<NS*LB;i++)z[i]+=dt/6.0*(g[i]+k[i]);
  }else for(long i=0;i<NS*LB;i++)z[i]+=dt*k[i];
  for(long i=0;i<NM*LB;i++)m[i]=y[NA*LB+i];
 }}}
"""

SENSITIVITY = """
void sensitivity(long b0,long b1,long T,double dt,long every,long rk4,in Z0,in S,long sb,long st,in Q,in P,out Y,out D,long rows,out work){
for(long blk=b0;blk<b1;blk++){
 double z[NS*LB],w[NS*LB],g[NS*LB],y[NJ*LB];
 double*d=work,*e=work+NS*NC*LB,*h=work+2*NS*NC*LB;
 const double*q=Q+blk*NQ*LB; double*o=Y+blk*rows*NS*LB; long row=0;
 for(long i=0;i<NS*LB;i++)z[i]=Z0[blk*NS*LB+i];
 for(long i=0;i<NS*NC*LB;i++)d[i]=0.0;
 for(long i=0;i<NS;i++)for(long b=0;b<LB;b++)d[(i*NC+NF+i)*LB+b]=1.0;
 for(long t=0;t<T;t++){
  const double*a=S+blk*sb+t*st;
  if(t%every==0){for(long i=0;i<NS*LB;i++)o[i]=z[i]; o+=NS*LB;
   for(long b=0;b<LB;b++){double*c=D+((blk*LB+b)*rows+row)*NS*NC; for(long i=0;i<NS*NC;i++)c[i]=d[i*LB+b];} row++;}
  if(t==T-1)break;
  jac(z,a,q,P,y);
  if(!rk4){
   for(long i=0;i<NS*LB;i++)z[i]+=dt*y[i];
   propagate(y,d,d,d,dt,h,0.0,0);
  }else{
   for(long i=0;i<NS*LB;i++){g[i]=y[i];w[i]=z[i]+0.5*dt*y[i];} propagate(y,d,d,e,0.5*dt,h,1.0,1); jac(w,a,q,P,y);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*y[i];w[i]=z[i]+0.5*dt*y[i];} propagate(y,e,d,e,0.5*dt,h,2.0,2); jac(w,a,q,P,y);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*y[i];w[i]=z[i]+dt*y[i];} propagate(y,e,d,e,dt,h,2.0,2); jac(w,a,q,P,y);
   for(long i=0;i<NS*LB;i++)z[i]+=dt/6.0*(g[i]+y[i]); propagate(y,e,d,e,dt,h,1.0,2);
   for(long i=0;i<NS*NC*LB;i++)d[i]+=dt/6.0*h[i];
  }}}}
"""


def propagation(j: Jacobian, states: int) -> str:
    """C function `propagate`: to = base + step (A from + B), and the weighted sum of the slopes.

    Sensitivities are propagated outside the traced function, column by column with the structural
    non-zeros of A only, which keeps the compiled graph small.
    """
    columns = len(j.free)
    text = [
        "static void propagate(in y,const double*from,const double*base,double*to,double step,double*sum,double weight,long mode){\n"
        "for(long k=0;k<NC;k++){\n#pragma omp simd\nfor(long b=0;b<LB;b++){\n"
    ]
    text += [f"const double s{i}=from[({i}*NC+k)*LB+b];" for i in range(states)]
    text += [f"double d{i}=0.0;" for i in range(states)]
    for n, (i, k) in enumerate(j.A):
        text.append(f"d{i}+=y[{states + n}*LB+b]*s{k};")
    first = states + len(j.A)
    if columns:
        text.append("if(k<NF){" + "".join(
            f"d{i}+=y[({first + n * columns}+k)*LB+b];" for n, i in enumerate(j.rows)) + "}")  # fmt: skip
    text.append("\n")
    text += [f"to[({i}*NC+k)*LB+b]=base[({i}*NC+k)*LB+b]+step*d{i};" for i in range(states)]
    text.append("\nif(mode==1){" + "".join(f"sum[({i}*NC+k)*LB+b]=weight*d{i};" for i in range(states)) + "}")
    text.append("\nif(mode==2){" + "".join(f"sum[({i}*NC+k)*LB+b]+=weight*d{i};" for i in range(states)) + "}")
    return "".join(text) + "}}}\n"


def rollout_source(system: System, rhs: Function, before: Function | None, lanewise: dict[int, int]) -> str:
    """C source of the kernel that integrates `system` over lanes."""
    acting = len(system.acting or system.series)
    ns, nm, nl = len(system.states), len(system.memory), len(system.logged)
    sizes = {
        "NS": ns, "NM": nm, "NM1": max(nm, 1), "NL": nl, "NA": acting, "NQ": max(len(lanewise), 1),
        "NY": max(acting + nm + nl, 1), "NO": ns + nm + nl,
    }  # fmt: skip
    text = HEADER + "".join(f"#define {k} {v}L\n" for k, v in sizes.items())
    text += lane_function("rhs", rhs, ("lane", "lane", "parameters"), lanewise)
    prepare = "const double*a=s;"
    if before is not None:
        kinds = ("scalar", "scalar", "lane", "lane", "lane", "parameters")
        text += lane_function("before", before, kinds, lanewise)
        prepare = "before(t0+t*dt,dt,z,m,s,q,P,y); const double*a=y;"
    return text + ROLLOUT.replace("PREPARE", prepare)


def sensitivity_source(system: System, j: Jacobian, lanewise: dict[int, int]) -> str:
    """C source of the kernel that integrates an open-loop `system` with its sensitivities."""
    ns, nf = len(system.states), len(j.free)
    sizes = {
        "NS": ns, "NF": nf, "NC": nf + ns, "NA": len(system.series), "NQ": max(len(lanewise), 1),
        "NJ": ns + len(j.A) + len(j.rows) * nf,
    }  # fmt: skip
    text = HEADER + "".join(f"#define {k} {v}L\n" for k, v in sizes.items())
    text += lane_function("jac", j.function, ("lane", "lane", "parameters"), lanewise)
    return text + propagation(j, ns) + SENSITIVITY
