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
