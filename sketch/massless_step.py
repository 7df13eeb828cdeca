import sys; sys.path.insert(0,"/tmp/wt/wip")
from typing import NamedTuple
import numpy as np, numba, time, math
from panto_env.backend.columns import columns, LANES_IN_BLOCK
from panto_env.backend.vectors import choose, larger, smaller, WIDTH
from panto_env.backend.compile import OPTIONS
from numba.extending import overload
from numba import types
from numba.core.extending import intrinsic
from llvmlite import ir
from numba.core import cgutils
from panto_env.backend.vectors import VectorType
@intrinsic
def vfloor(typing, v):
    def build(context,builder,sig,values):
        k=values[0].type; fn=cgutils.get_or_insert_function(builder.module, ir.FunctionType(k,[k]), "llvm.floor.v8f64"); return builder.call(fn,values)
    return v(v),build
@intrinsic
def vabs(typing, v):
    def build(context,builder,sig,values):
        k=values[0].type; fn=cgutils.get_or_insert_function(builder.module, ir.FunctionType(k,[k]), "llvm.fabs.v8f64"); return builder.call(fn,values)
    return v(v),build
L=int(sys.argv[1]) if len(sys.argv)>1 else 32
class G(NamedTuple):
    mean: float; variation: float; spans: float; strip: float; damping: float; limit: float
LANES_IN_BLOCK[G]=L
SINE = tuple((-1) ** k * (2 * math.pi) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(11))
@numba.njit(forceinline=True,**OPTIONS)
def cosine(turns):
    turns=turns+0.25
    halves=vfloor(2.0*turns+0.5); rest=turns-0.5*halves; odd=halves-2.0*vfloor(0.5*halves); sq=rest*rest
    t=SINE[10]*sq+SINE[9]
    for k in range(8,-1,-1): t=t*sq+SINE[k]
    return (1.0-2.0*odd)*rest*t
STEP,STRIDE,NOM,FORCE,GAP,ACT,STATE=0,1,2,3,4,5,6   # STATE..+6 -> 12
COST,LOSS,LAST,FILT,SAMP,DEV,SQ,MX,MN,EFF,RATE,REW,CMD,FREE=12,13,14,15,21,22,23,24,25,26,27,28,29,30
ROWS=40
@numba.njit(**OPTIONS)
def control(line, table, K, sections, act, obs, rew, first, last, substeps):
    n=6
    for b in range(first, last, L):
        for g in range(b, b+L, 8):
            c=columns(line,table,g)
            c[CMD]=smaller(larger(columns(line,act,g)[0],-1.0),1.0)*line.limit
            c[COST]=0.0*c[STEP]
        for _ in range(substeps):
            for g in range(b, b+L, 8):
                c=columns(line,table,g); k=columns(line,K,0)
                was=c[ACT]; force_in=c[CMD]
                c[ACT]=force_in
                drive=c[NOM]+force_in
                for r in range(n):
                    f=k[36+r]*drive
                    for j in range(0,n,2): f+=k[6*r+j]*c[STATE+j]+k[6*r+j+1]*c[STATE+j+1]
                    c[FREE+r]=f
                step=c[STEP]; stride=c[STRIDE]
                stiff=line.mean*(1.0+line.variation*cosine(line.spans*(stride*(step+0.5))))
                head,free=c[STATE],c[FREE]
                kc=k[42]
                force=(0.5*(head+free)/(line.strip+1.0/stiff)+line.damping*(free-head))/(1.0-0.5*kc*stiff)
                force=larger(force,0.0)
                for r in range(n): c[STATE+r]=c[FREE+r]+k[42+r]*force
                c[STEP]=step+1.0
                old=c[FORCE]; c[FORCE]=force
                nom=c[NOM]
                c[COST]=c[COST]+vabs(old-nom)+vabs(force-nom)
                lost=choose(force>0.0, 0.0*force, 0.0*force+1.0)
                c[LOSS]=lost*(c[LOSS]+1.0)
                v=force
                for s in range(3):
                    a0=c[FILT+2*s]; a1=c[FILT+2*s+1]
                    out=sections[s,0]*v+a0
                    c[FILT+2*s]=sections[s,1]*v-sections[s,4]*out+a1
                    c[FILT+2*s+1]=sections[s,2]*v-sections[s,5]*out
                    v=out
                c[SAMP]=c[SAMP]+1.0
                dev=v-nom
                c[DEV]=c[DEV]+dev; c[SQ]=c[SQ]+dev*dev
                c[MX]=larger(c[MX],v); c[MN]=smaller(c[MN],v)
                c[EFF]=c[EFF]+force_in*force_in
                jump=force_in-was; c[RATE]=c[RATE]+jump*jump
        for g in range(b, b+L, 8):
            c=columns(line,table,g)
            a=c[CMD]*(1.0/line.limit); ch=0.5*(a-c[LAST]); c[LAST]=a
            c[REW]=0.0-(c[COST]*0.01+a*a*0.1+ch*ch)
            turns=c[STRIDE]*c[STEP]*line.spans
            c[FREE]=cosine(turns-0.25); c[FREE+1]=cosine(turns)
            for j in range(8):
                i=g+j
                row=table[g//L,:,g%L+j]
                rew[i]=row[REW]
                for e in range(6): obs[i,e]=row[STATE+e]*10.0
                obs[i,6]=row[FORCE]*0.01; obs[i,7]=row[FREE]; obs[i,8]=row[FREE+1]
N=4096
rng=np.random.default_rng(0)
def al(shape):
    n=int(np.prod(shape)); raw=np.zeros(n+8); o=(-raw.ctypes.data%64)//8; return raw[o:o+n].reshape(shape)
table=al((N//L,ROWS,L)); table[:,STRIDE]=rng.uniform(.4,.5,(N//L,L)); table[:,NOM]=100; table[:,MN]=1e9
K=al((1,48,L)); K[0,:36]=(np.eye(6)*.9).ravel()[:,None]; K[0,36:42]=1e-4; K[0,42:48]=-1e-5
sec=np.full((3,6),.1); act=al((N//L,1,L)); act[:]=rng.uniform(-1,1,act.shape)
obs=np.zeros((N,9),np.float32); rew=np.zeros(N)
line=G(3000.,.3,1/60,2e-5,0.,100.)
t=time.perf_counter(); control(line,table,K,sec,act,obs,rew,0,N,2); print("compile",time.perf_counter()-t)
b=1e9
for _ in range(60):
    t=time.perf_counter(); control(line,table,K,sec,act,obs,rew,0,N,2); b=min(b,time.perf_counter()-t)
print("L",L,"lanes/s %.1f M"%(N/b/1e6), "us",b*1e6, np.isfinite(table).all())
