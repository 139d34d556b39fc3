#ifndef KERNEL
#define KERNEL extern "C" __global__ void __launch_bounds__(BLOCK)
#define EACH(i,n) _Pragma("unroll") for(int i=0;i<n;i++)
#define CONSTANT __constant__
#define DEVICE __device__
#endif
#define R(x) ((real)(x))
#define INF (R(1.0)/R(0.0))
#define NAN_ (INF-INF)
#define WEIGHT(stage) (stage==0||stage==3?R(1.0):R(2.0))
#define AHEAD(stage,dt) (stage==2?dt:R(0.5)*dt)
typedef long long whole; typedef const real*__restrict__ in; typedef real*__restrict__ out;
CONSTANT real K[NP+NU];
