KERNEL uniform(real*U){
UNIFORM_SCOPE
}
KERNEL rollout(whole lanes,whole T,double t0,double step,whole every,whole stages,in Z0,in M0,in S,whole st,whole sc,whole sl,in Q,out Y){
 const whole n=lanes,lane=blockIdx.x*(whole)blockDim.x+threadIdx.x;
 if(lane>=n)return;
 const real dt=(real)step;
 real z[NS],m[NM1]; whole due=0;
 EACH(i,NS)z[i]=Z0[i*n+lane];
 EACH(i,NM)m[i]=M0[i*n+lane];
LANE_SCOPE
 for(whole t=0;t<T;t++){
  in s=S+t*st+lane*sl;
STEP_SCOPE
  if(due==0){
   EACH(i,NS)Y[i*n+lane]=z[i];
   EACH(i,NM)Y[(NS+i)*n+lane]=m[i];
   LOGGED
   Y+=NO*n; due=every;
  }
  if(t==T-1)break;
  due--;
  real w[NS],g[NS];
  EACH(i,NS){w[i]=z[i];g[i]=R(0.0);}
  _Pragma("unroll 1") for(int stage=0;stage<stages;stage++){
STAGE_SCOPE
   const real weight=WEIGHT(stage),ahead=AHEAD(stage,dt);
   EACH(i,NS){g[i]+=weight*k[i];w[i]=z[i]+ahead*k[i];}
  }
  const real by=stages==4?dt/R(6.0):dt;
  EACH(i,NS)z[i]+=by*g[i];
  MEMORY
 }}
