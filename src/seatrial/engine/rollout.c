void evaluate(long nb,in Z,in A,in Q,in P,out Y){double held[NH*LB];
for(long q=0;q<nb;q++){rhs_held(A+q*NA*LB,Q+q*NQ*LB,P,held); rhs(Z+q*NS*LB,A+q*NA*LB,Q+q*NQ*LB,P,held,Y+q*NS*LB);}}
void rollout(long b0,long b1,long T,double t0,double dt,long every,long rk4,in Z0,in M0,in S,long sb,long st,in Q,in P,out Y,long rows,const void*const*W){
for(long blk=b0;blk<b1;blk++){
 double z[NS*LB],w[NS*LB],k[NS*LB],g[NS*LB],held[NH*LB],both[2*NY*LB],first[NM1*LB],*y=both,*m=first;
 const double*q=Q+blk*NQ*LB; double*o=Y+blk*rows*NO*LB;
 AROUND
 for(long i=0;i<NS*LB;i++)z[i]=Z0[blk*NS*LB+i];
 for(long i=0;i<NM*LB;i++)m[i]=M0[blk*NM*LB+i];
 for(long t=0;t<T;t++){
  const double*s=S+blk*sb+t*st;
  LOOK
  PREPARE
  if(t%every==0){for(long i=0;i<NS*LB;i++)o[i]=z[i]; for(long i=0;i<NM*LB;i++)o[NS*LB+i]=m[i];
   for(long i=0;i<NL*LB;i++)o[(NS+NM)*LB+i]=y[(NA+NM)*LB+i]; o+=NO*LB;}
  if(t==T-1)break;
  rhs_held(a,q,P,held);
  SUBSTEPS
  FIRST
  rhs(z,a,q,P,held,k);
  if(rk4){
   for(long i=0;i<NS*LB;i++){g[i]=k[i];w[i]=z[i]+0.5*h*k[i];} rhs(w,a,q,P,held,k);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*k[i];w[i]=z[i]+0.5*h*k[i];} rhs(w,a,q,P,held,k);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*k[i];w[i]=z[i]+h*k[i];} rhs(w,a,q,P,held,k);
   for(long i=0;i<NS*LB;i++)z[i]+=h/6.0*(g[i]+k[i]);
  }else for(long i=0;i<NS*LB;i++)z[i]+=h*k[i];
  LAST
  m=y+NA*LB; y=y==both?both+NY*LB:both;
 }}}
