KERNEL uniform(real*U){
UNIFORM_SCOPE
}
KERNEL sensitivity(whole lanes,whole T,double step,whole every,whole stages,in Z0,in S,whole st,whole sc,whole sl,in Q,out Y,out D,whole f0,whole s0,whole columns){
 const whole n=lanes,lane=blockIdx.x*(whole)blockDim.x+threadIdx.x;
 if(lane>=n)return;
 const real dt=(real)step;
 real z[NS],d[NC*NS]; whole due=0;
 EACH(i,NS)z[i]=Z0[i*n+lane];
 EACH(c,NC)EACH(i,NS)d[c*NS+i]=c>=NF&&c-NF+s0==i?R(1.0):R(0.0);
LANE_SCOPE
 for(whole t=0;t<T;t++){
  in s=S+t*st+lane*sl;
STEP_SCOPE
  if(due==0){
   EACH(i,NS)Y[i*n+lane]=z[i];
   EACH(c,NC)EACH(i,NS)D[(i*columns+(c<NF?f0+c:columns-NS+s0+c-NF))*n+lane]=d[c*NS+i];
   Y+=NS*n; D+=NS*columns*n; due=every;
  }
  if(t==T-1)break;
  due--;
  real w[NS],g[NS],e[NC*NS],h[NC*NS];
  EACH(i,NS){w[i]=z[i];g[i]=R(0.0);}
  EACH(i,NC*NS){e[i]=d[i];h[i]=R(0.0);}
  _Pragma("unroll 1") for(int stage=0;stage<stages;stage++){
STAGE_SCOPE
   const real weight=WEIGHT(stage),ahead=AHEAD(stage,dt);
   EACH(c,NC){
    real v[NS];
    const real*x=e+c*NS;
COLUMN
    EACH(i,NS){h[c*NS+i]+=weight*v[i];e[c*NS+i]=d[c*NS+i]+ahead*v[i];}
   }
   EACH(i,NS){g[i]+=weight*k[i];w[i]=z[i]+ahead*k[i];}
  }
  const real by=stages==4?dt/R(6.0):dt;
  EACH(i,NS)z[i]+=by*g[i];
  EACH(i,NC*NS)d[i]+=by*h[i];
 }}
