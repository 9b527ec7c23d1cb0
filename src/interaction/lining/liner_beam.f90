! SPDX-License-Identifier: MIT
!> A piece of a lining between two nodes: beam along a path, with the law of its section; nothing here refers to blocks.
!>
!> The two ends are bodies, a and b, which reach rigidly to the centre c of the path. Deformations d are the motion of b
!> against a there, along two axes, and its rotation; forces f belong to them. About c, and along the principal axes,
!> the elastic flexibility of the path is diagonal:
!>
!>     F = integral of  m m^T/EI + n n^T/EA + q q^T/GA  over the path,   N = n.f,  Q = q.f,  M = m.f
!>
!> exactly for every path and length (but for the share t^2/(12 R^2) of a curved beam): Euler's beam with the shear of
!> Timoshenko, per unit of width, in plane strain
!> E' = E/(1 - nu^2), A = t, I = t^3/12, shear area 5 t/6. So it is for forces at nodes. Rock presses a lining evenly
!> between them, so that N follows the path: there the moments N e of the bow of the path over its chord are none, which
!> otherwise make a ring of 24 beams 4 % too soft where t is R/17. F and B_k are then those of the path without the
!> parabola that turns by as much as it does.
!>
!> A section that cracks or crushes deforms by more than F has; that is added at the ends and the middle of the path, by
!> Simpson's rule:
!>
!>     d = F f + sum over k of w_k B_k^T (e_k - C B_k f),     B_k f = (N, M) there = forces of the strains e_k
!>
!> The stress over the section is elastic, without tension where it has cracked, and stays at the compressive strength
!> (a share `hardening` of the stiffness remains). The complementary energy is convex: Newton's method with a search
!> along the line finds f. Cracks and crushed places are noted with `accept_beam` only, for the next step.
!>
!> Axial force and strain are positive in tension; moment and curvature where they pull on the side of the opening.
module rockdda_interaction_liner_beam
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: liner_section_type, beam_type, beam_state_type, beam_response_type, new_beam, respond_beam, accept_beam, &
      deformation_of, section_response, forces_at, n_sections, share_of_strength

   integer, parameter :: n_sections = 3
   !> Shares of the stiffness beyond the compressive strength, and of cracked concrete in tension.
   real(wp), parameter :: hardening = 1.0e-4_wp, bridging = 1.0e-6_wp
   !> Forces below this share of the compressive strength do not break a cracked section.
   real(wp), parameter :: no_force = 1.0e-3_wp
   !> Forces agree to this share.
   real(wp), parameter :: agreement = 1.0e-12_wp
   integer, parameter :: most_steps = 60

   type :: liner_section_type
      real(wp) :: thickness = 1                   !! [length]
      real(wp) :: modulus = 1                     !! E' [stress]
      real(wp) :: shear = 1                       !! G over E'
      real(wp) :: compression = huge(1.0_wp)      !! strength [stress], > 0
      real(wp) :: tension = huge(1.0_wp)          !! [stress], >= 0
   end type liner_section_type

   !> What does not change, for a modulus E' of 1.
   type :: beam_type
      real(wp) :: center(2) = 0                   !! c when it was installed [length]
      real(wp) :: angle = 0                       !! of the first axis [rad]
      real(wp) :: length = 0
      real(wp) :: eccentricity = 0                !! t^2/(12 R), of the axis on which N alone does not bend [length]
      real(wp) :: flexibility(3) = 1
      real(wp) :: of_force(2, 3, n_sections) = 0  !! B_k
      real(wp) :: shear(3, n_sections) = 0        !! Q there
   end type beam_type

   !> What lasts from step to step.
   type :: beam_state_type
      real(wp) :: free(3) = 0                     !! deformation without force: of a change of the modulus [length, rad]
      logical :: cracked(n_sections) = .false.
      logical :: crushed(n_sections) = .false.
   end type beam_state_type

   type :: beam_response_type
      real(wp) :: f(3) = 0
      real(wp) :: stiffness(3, 3) = 0
      real(wp) :: strain(2, n_sections) = 0
      real(wp) :: energy = 0
   end type beam_response_type

contains

   !> A beam along a path from body a to body b.
   pure type(beam_type) function new_beam(installed, section, side, is_pressed) result(beam)
      real(wp), intent(in) :: installed(:, :)     !! (2, points) the path [length]
      type(liner_section_type), intent(in) :: section
      integer, intent(in) :: side                 !! the opening lies to the left (1) or right (-1) of the path
      logical, intent(in) :: is_pressed           !! along its length, so that N follows the path
      !> places and weights of an integration that is exact for the squares of moments
      real(wp), parameter :: place(3) = [0.0_wp, 0.5_wp, 1.0_wp], weight(3) = [1.0_wp, 4.0_wp, 1.0_wp]/6
      real(wp) :: path(2, size(installed, 2)), curvature, a, i, g, x(2), t(2), n(2), l, f(2, 2), arm(2), axes(2, 2)
      real(wp) :: middle(2), reach, s
      integer :: j, k
      call measure(installed, beam%length, beam%center)
      curvature = curvature_of(installed, beam%length)
      path = installed
      if (is_pressed) path = flattened(installed, curvature)
      ! lengths and places are those of the flattened path, which moves with the centre of the one installed
      call measure(path, beam%length, middle)
      path = path + spread(beam%center - middle, 2, size(path, 2))
      a = section%thickness
      i = section%thickness**3/12
      g = section%shear*section%thickness*5/6
      f = 0
      do k = 1, size(path, 2) - 1
         l = norm2(path(:, k + 1) - path(:, k))
         if (.not. l > 0) cycle
         t = (path(:, k + 1) - path(:, k))/l
         n = [-t(2), t(1)]
         f = f + (l/a)*outer(t) + (l/g)*outer(n)
         do j = 1, 3
            x = beam%center - (path(:, k) + place(j)*(path(:, k + 1) - path(:, k)))
            arm = [-x(2), x(1)]
            f = f + (l*weight(j)/i)*outer(arm)
         end do
      end do
      ! principal axes, the first one the stiffer: along a straight beam
      beam%angle = 0.5_wp*atan2(-2*f(1, 2), f(2, 2) - f(1, 1))
      t = path(:, size(path, 2)) - path(:, 1)
      if (cos(beam%angle)*t(1) + sin(beam%angle)*t(2) < 0) beam%angle = beam%angle + acos(-1.0_wp)
      axes = reshape([cos(beam%angle), sin(beam%angle), -sin(beam%angle), cos(beam%angle)], [2, 2])
      beam%flexibility = [dot_product(axes(:, 1), matmul(f, axes(:, 1))), &
                          dot_product(axes(:, 2), matmul(f, axes(:, 2))), beam%length/i]
      beam%eccentricity = side*section%thickness**2/12*curvature
      do j = 1, n_sections
         reach = place(j)*beam%length
         s = 0
         do k = 1, size(path, 2) - 1
            l = norm2(path(:, k + 1) - path(:, k))
            if (s + l >= reach*(1 - 1.0e-12_wp) .and. l > 0) exit
            s = s + l
         end do
         k = min(k, size(path, 2) - 1)
         l = norm2(path(:, k + 1) - path(:, k))
         t = (path(:, k + 1) - path(:, k))/l
         x = path(:, k) + (reach - s)*t
         beam%of_force(:, :, j) = map_at(beam%center, axes, x, t, side)
         beam%of_force(2, :, j) = beam%of_force(2, :, j) + beam%eccentricity*beam%of_force(1, :, j)
         beam%shear(:, j) = [matmul([-t(2), t(1)], axes), 0.0_wp]*side
      end do

   contains

      !> v v^T
      pure function outer(v)
         real(wp), intent(in) :: v(2)
         real(wp) :: outer(2, 2)
         outer = spread(v, 2, 2)*spread(v, 1, 2)
      end function outer

   end function new_beam

   !> Length of a path and its centre.
   pure subroutine measure(path, length, center)
      real(wp), intent(in) :: path(:, :)
      real(wp), intent(out) :: length, center(2)
      real(wp) :: l
      integer :: k
      length = 0
      center = 0
      do k = 1, size(path, 2) - 1
         l = norm2(path(:, k + 1) - path(:, k))
         length = length + l
         center = center + l*0.5_wp*(path(:, k + 1) + path(:, k))
      end do
      center = center/length
   end subroutine measure

   !> A path without the parabola of its mean curvature over its chord: of an arc the chord remains.
   pure function flattened(path, curvature) result(flat)
      real(wp), intent(in) :: path(:, :)
      real(wp), intent(in) :: curvature           !! to the left positive [1/length]
      real(wp) :: flat(2, size(path, 2)), chord(2), l, along
      integer :: k, m
      m = size(path, 2)
      flat = path
      chord = path(:, m) - path(:, 1)
      l = norm2(chord)
      if (.not. l > 0) return
      chord = chord/l
      do k = 2, m - 1
         along = dot_product(path(:, k) - path(:, 1), chord)
         flat(:, k) = path(:, k) + 0.5_wp*curvature*along*(l - along)*[-chord(2), chord(1)]
      end do
   end function flattened

   !> Mean curvature of a path, to the left positive.
   pure real(wp) function curvature_of(path, length) result(curvature)
      real(wp), intent(in) :: path(:, :)
      real(wp), intent(in) :: length
      real(wp) :: a(2), b(2), along
      integer :: m
      m = size(path, 2)
      curvature = 0
      if (m < 3) return
      a = path(:, 2) - path(:, 1)
      b = path(:, m) - path(:, m - 1)
      along = length
      if (m > 3) along = length - 0.5_wp*(norm2(a) + norm2(b))
      curvature = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))/along
   end function curvature_of

   !> Axial force and moment at a point of a path, of forces at the centre.
   pure function map_at(center, axes, x, t, side) result(b)
      real(wp), intent(in) :: center(2), axes(2, 2)
      real(wp), intent(in) :: x(2), t(2)          !! point of the path, direction there
      integer, intent(in) :: side
      real(wp) :: b(2, 3), arm(2)
      arm = center - x
      b(1, :) = [dot_product(t, axes(:, 1)), dot_product(t, axes(:, 2)), 0.0_wp]
      b(2, :) = -side*[arm(1)*axes(2, 1) - arm(2)*axes(1, 1), arm(1)*axes(2, 2) - arm(2)*axes(1, 2), 1.0_wp]
   end function map_at

   !> Axial force, moment and shear force at the start (1), in the middle and at the end (3) of the beam.
   pure function forces_at(beam, f, place) result(nmq)
      type(beam_type), intent(in) :: beam
      real(wp), intent(in) :: f(3)
      integer, intent(in) :: place
      real(wp) :: nmq(3)
      nmq(1:2) = matmul(beam%of_force(:, :, place), f)
      nmq(3) = dot_product(beam%shear(:, place), f)
   end function forces_at

   !> Forces of a deformation, their derivatives and the stored energy.
   pure subroutine respond_beam(beam, section, state, d, response)
      type(beam_type), intent(in) :: beam
      type(liner_section_type), intent(in) :: section
      type(beam_state_type), intent(in) :: state
      real(wp), intent(in) :: d(3)
      type(beam_response_type), intent(out) :: response
      real(wp) :: elastic(3), strains(2, n_sections), g(3), step(3), f(3), compliance(3, 3), drop, low, high, a
      integer :: i, k
      logical :: is_elastic
      elastic = section%modulus/beam%flexibility
      response%f = elastic*(d - state%free)
      response%stiffness = 0
      do k = 1, 3
         response%stiffness(k, k) = elastic(k)
      end do
      response%energy = 0.5_wp*dot_product(response%f, d - state%free)
      is_elastic = .true.
      do k = 1, n_sections
         response%strain(:, k) = elastic_strain(section, matmul(beam%of_force(:, :, k), response%f))
         if (.not. stays_elastic(section, state%cracked(k), response%strain(:, k))) is_elastic = .false.
      end do
      if (is_elastic) return
      f = response%f
      do i = 1, most_steps
         call gap(f, g, strains, compliance)
         step = -solve3(compliance, g)
         drop = dot_product(g, step)
         if (.not. drop < 0) exit
         if (-drop <= agreement**2*max(response%energy, tiny(1.0_wp))) exit
         a = 1
         low = 0
         high = 1
         do k = 1, most_steps
            call gap(f + a*step, g, strains, compliance)
            if (dot_product(g, step) > -0.5_wp*drop) then
               high = a
            else if (dot_product(g, step) < 0.5_wp*drop .and. a < 1) then
               low = a
            else
               exit
            end if
            a = 0.5_wp*(low + high)
         end do
         f = f + a*step
         if (maxval(abs(a*step)*sqrt(beam%flexibility)) <= agreement*maxval(abs(f)*sqrt(beam%flexibility))) exit
      end do
      call gap(f, g, strains, compliance)
      response%f = f
      response%strain = strains
      response%stiffness = inverse3(compliance)
      ! of the parts that F has besides the sections, and of the sections
      response%energy = 0.5_wp*dot_product(f, f*beam%flexibility/section%modulus)
      do k = 1, n_sections
         associate (forces => matmul(beam%of_force(:, :, k), f))
            response%energy = response%energy + weight_of(beam, k)*(section_energy(section, state%cracked(k), &
               strains(:, k)) - 0.5_wp*dot_product(forces, elastic_strain(section, forces)))
         end associate
      end do

   contains

      !> By what the deformation of forces exceeds d, with its derivative.
      pure subroutine gap(f, g, strains, compliance)
         real(wp), intent(in) :: f(3)
         real(wp), intent(out) :: g(3), strains(2, n_sections), compliance(3, 3)
         real(wp) :: tangent(2, 2), b(2, 3)
         integer :: k
         g = f*beam%flexibility/section%modulus - (d - state%free)
         compliance = 0
         do k = 1, 3
            compliance(k, k) = beam%flexibility(k)/section%modulus
         end do
         do k = 1, n_sections
            b = beam%of_force(:, :, k)
            call strain_of(section, state%cracked(k), matmul(b, f), strains(:, k), tangent)
            g = g + weight_of(beam, k)*matmul(strains(:, k) - elastic_strain(section, matmul(b, f)), b)
            compliance = compliance + weight_of(beam, k)*matmul(transpose(b), matmul(more(tangent), b))
         end do
      end subroutine gap

      !> Compliance of a section beyond the elastic one.
      pure function more(tangent) result(c)
         real(wp), intent(in) :: tangent(2, 2)
         real(wp) :: c(2, 2)
         c = inverse2(tangent)
         c(1, 1) = c(1, 1) - 1/(section%modulus*section%thickness)
         c(2, 2) = c(2, 2) - 12/(section%modulus*section%thickness**3)
      end function more

   end subroutine respond_beam

   !> Deformation of given forces: for a new modulus, under which they stay.
   pure function deformation_of(beam, section, state, f) result(d)
      type(beam_type), intent(in) :: beam
      type(liner_section_type), intent(in) :: section
      type(beam_state_type), intent(in) :: state
      real(wp), intent(in) :: f(3)
      real(wp) :: d(3), strain(2), tangent(2, 2)
      integer :: k
      d = f*beam%flexibility/section%modulus
      do k = 1, n_sections
         associate (forces => matmul(beam%of_force(:, :, k), f))
            call strain_of(section, state%cracked(k), forces, strain, tangent)
            d = d + weight_of(beam, k)*matmul(strain - elastic_strain(section, forces), beam%of_force(:, :, k))
         end associate
      end do
   end function deformation_of

   !> Length of the path that a section represents.
   pure real(wp) function weight_of(beam, k)
      type(beam_type), intent(in) :: beam
      integer, intent(in) :: k
      weight_of = beam%length*merge(4.0_wp, 1.0_wp, k == 2)/6
   end function weight_of

   !> Share of the limit that axial force (tension positive) and moment use, if both grow alike; below 0: no strength.
   !>
   !> The limit of a sound section is the wider one of its first crack or crushing and of the crushing of the cracked
   !> section, that of a cracked one the latter: above 1 it crushes. Huge where a cracked section is pulled or its force
   !> lies beyond its edge; forces that a cracked section need not bear (`no_force` of its strength) count as none.
   elemental real(wp) function share_of_strength(section, is_cracked, force, moment) result(share)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: is_cracked
      real(wp), intent(in) :: force, moment
      real(wp) :: n, m, bend, depth, sound
      logical :: crushes, cracks
      crushes = section%compression < 0.5_wp*huge(1.0_wp)
      cracks = section%tension < 0.5_wp*huge(1.0_wp)
      share = -1
      if (.not. (crushes .or. (cracks .and. .not. is_cracked))) return
      associate (t => section%thickness, fc => section%compression, ft => section%tension)
         n = -force
         m = abs(moment)
         bend = 6*m/t**2
         sound = 0
         if (crushes) sound = (bend + n/t)/fc
         if (cracks .and. ft > 0) sound = max(sound, (bend - n/t)/ft)
         if (cracks .and. .not. ft > 0 .and. bend > n/t) sound = huge(sound)
         share = max(0.0_wp, sound)
         if (.not. (crushes .and. (cracks .or. is_cracked))) return
         depth = 0
         if (n > 0) depth = 3*(0.5_wp*t - m/n)      ! that is pressed
         share = huge(share)
         if (depth > 0) share = 2*n/depth/fc
         if (depth >= t) share = (bend + n/t)/fc
         if (.not. is_cracked) share = min(share, max(0.0_wp, sound))
         if (share >= huge(share) .and. max(abs(n), m/t) <= no_force*fc*t) share = 0
      end associate
   end function share_of_strength

   !> Strain and curvature of an elastic section.
   pure function elastic_strain(section, forces) result(strain)
      type(liner_section_type), intent(in) :: section
      real(wp), intent(in) :: forces(2)           !! N, M
      real(wp) :: strain(2)
      strain = forces/(section%modulus*[section%thickness, section%thickness**3/12])
   end function elastic_strain

   !> Is a section elastic at a strain?
   pure logical function stays_elastic(section, cracked, strain)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: cracked
      real(wp), intent(in) :: strain(2)
      real(wp) :: edges(2)
      edges = edge_strains(section, strain)
      stays_elastic = minval(edges)*section%modulus >= -section%compression
      if (cracked) stays_elastic = stays_elastic .and. maxval(edges) <= 0
   end function stays_elastic

   !> Strains of both faces: of the opening, and of the rock.
   pure function edge_strains(section, strain) result(edges)
      type(liner_section_type), intent(in) :: section
      real(wp), intent(in) :: strain(2)
      real(wp) :: edges(2)
      edges = strain(1) + [0.5_wp, -0.5_wp]*section%thickness*strain(2)
   end function edge_strains

   !> Cracks and crushed places of a deformation that is accepted.
   pure subroutine accept_beam(section, response, state)
      type(liner_section_type), intent(in) :: section
      type(beam_response_type), intent(in) :: response
      type(beam_state_type), intent(inout) :: state
      real(wp), parameter :: beyond = 1 + 1.0e-9_wp
      real(wp) :: edges(2)
      integer :: k
      do k = 1, n_sections
         edges = section%modulus*edge_strains(section, response%strain(:, k))
         if (section%tension < 0.5_wp*huge(1.0_wp)) state%cracked(k) = state%cracked(k) .or. &
            maxval(edges) > max(section%tension*beyond, 1.0e-9_wp*abs(minval(edges)))
         state%crushed(k) = state%crushed(k) .or. -minval(edges) > section%compression*beyond
      end do
   end subroutine accept_beam

   !> Stress of a strain.
   pure real(wp) function stress_at(section, cracked, strain) result(stress)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: cracked
      real(wp), intent(in) :: strain
      stress = section%modulus*strain
      if (cracked .and. strain > 0) stress = bridging*stress
      if (stress < -section%compression) stress = -section%compression + hardening*(stress + section%compression)
   end function stress_at

   !> Axial force and moment of strain and curvature, with their derivatives: the section in parts in each of which the
   !> stress is linear.
   pure subroutine section_response(section, cracked, strain, forces, tangent)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: cracked
      real(wp), intent(in) :: strain(2)           !! of the axis, curvature
      real(wp), intent(out) :: forces(2)          !! N, M
      real(wp), intent(out) :: tangent(2, 2)
      real(wp) :: y(4), at(2), l, e, slope, mid
      integer :: k, n
      call parts(section, cracked, strain, y, n)
      forces = 0
      tangent = 0
      do k = 1, n - 1
         l = y(k + 1) - y(k)
         if (.not. l > 0) cycle
         mid = 0.5_wp*(y(k) + y(k + 1))
         e = strain(1) + mid*strain(2)
         slope = section%modulus
         if (cracked .and. e > 0) slope = bridging*slope
         if (section%modulus*e < -section%compression) slope = hardening*slope
         at(1) = stress_at(section, cracked, e)
         at(2) = slope*strain(2)
         ! stress at(1) + at(2) (y - mid) over the part
         forces = forces + l*[at(1), at(1)*mid + at(2)*l**2/12]
         tangent(1, 1) = tangent(1, 1) + slope*l
         tangent(2, 1) = tangent(2, 1) + slope*l*mid
         tangent(2, 2) = tangent(2, 2) + slope*l*(mid**2 + l**2/12)
      end do
      tangent(1, 2) = tangent(2, 1)
   end subroutine section_response

   !> Energy of a section over its length, by Simpson's rule, which is exact in each part.
   pure real(wp) function section_energy(section, cracked, strain) result(stored)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: cracked
      real(wp), intent(in) :: strain(2)
      real(wp) :: y(4)
      integer :: k, n
      call parts(section, cracked, strain, y, n)
      stored = 0
      do k = 1, n - 1
         stored = stored + (y(k + 1) - y(k))/6*(density(y(k)) + 4*density(0.5_wp*(y(k) + y(k + 1))) + density(y(k + 1)))
      end do

   contains

      !> Energy of a strain over area and length.
      pure real(wp) function density(y)
         real(wp), intent(in) :: y
         real(wp) :: e, limit
         e = strain(1) + y*strain(2)
         limit = section%compression/section%modulus
         if (e > 0) then
            density = 0.5_wp*section%modulus*e**2*merge(bridging, 1.0_wp, cracked)
         else if (-e > limit) then
            density = 0.5_wp*section%modulus*limit**2 + section%compression*(-e - limit) + &
                      0.5_wp*hardening*section%modulus*(-e - limit)**2
         else
            density = 0.5_wp*section%modulus*e**2
         end if
      end function density

   end function section_energy

   !> Places across a section between which the stress is linear, ascending.
   pure subroutine parts(section, cracked, strain, y, n)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: cracked
      real(wp), intent(in) :: strain(2)
      real(wp), intent(out) :: y(4)
      integer, intent(out) :: n
      real(wp) :: half, inner(2)
      integer :: k
      half = 0.5_wp*section%thickness
      y = half
      y(1) = -half
      n = 1
      if (abs(strain(2)) > 0) then
         inner = 2*half
         if (cracked) inner(1) = quotient(-strain(1))
         if (section%compression < 0.5_wp*huge(1.0_wp)) &
            inner(2) = quotient(-section%compression/section%modulus - strain(1))
         if (inner(1) > inner(2)) inner = inner([2, 1])
         do k = 1, 2
            if (abs(inner(k)) >= half) cycle
            n = n + 1
            y(n) = inner(k)
         end do
      end if
      n = n + 1
      y(n) = half

   contains

      !> e over the curvature, or what lies outside of the section.
      pure real(wp) function quotient(e)
         real(wp), intent(in) :: e
         quotient = 2*half
         if (abs(e) < half*abs(strain(2))) quotient = e/strain(2)
      end function quotient

   end subroutine parts

   !> Strain and curvature of axial force and moment, and the tangent there.
   pure subroutine strain_of(section, cracked, forces, strain, tangent)
      type(liner_section_type), intent(in) :: section
      logical, intent(in) :: cracked
      real(wp), intent(in) :: forces(2)
      real(wp), intent(out) :: strain(2), tangent(2, 2)
      real(wp) :: now(2), missing(2), step(2), work, a, low, high, size(2), start(2)
      integer :: i, k
      strain = elastic_strain(section, forces)
      size = [section%modulus*section%thickness, section%modulus*section%thickness**3/12]
      do i = 1, most_steps
         call section_response(section, cracked, strain, now, tangent)
         missing = forces - now
         step = matmul(inverse2(tangent), missing)
         work = dot_product(missing, step)
         if (.not. work > 0) exit
         if (all(missing**2/size <= (1.0e-14_wp)**2*sum(forces**2/size))) exit
         start = strain
         a = 1
         low = 0
         high = 1
         do k = 1, most_steps
            strain = start + a*step
            call section_response(section, cracked, strain, now, tangent)
            missing = forces - now
            if (dot_product(missing, step) < -0.5_wp*work) then
               high = a
            else if (dot_product(missing, step) > 0.5_wp*work .and. a < 1) then
               low = a
            else
               exit
            end if
            a = 0.5_wp*(low + high)
         end do
      end do
   end subroutine strain_of

   !> Inverse of a symmetric matrix of two rows.
   pure function inverse2(a) result(b)
      real(wp), intent(in) :: a(2, 2)
      real(wp) :: b(2, 2)
      b = reshape([a(2, 2), -a(2, 1), -a(1, 2), a(1, 1)], [2, 2])/(a(1, 1)*a(2, 2) - a(1, 2)*a(2, 1))
   end function inverse2

   !> Inverse of a symmetric, positive definite matrix of three rows, by its scaled form.
   pure function inverse3(a) result(b)
      real(wp), intent(in) :: a(3, 3)
      real(wp) :: b(3, 3), s(3), c(3, 3)
      integer :: i, j
      s = [(1/sqrt(a(i, i)), i=1, 3)]
      do j = 1, 3
         c(:, j) = s*a(:, j)*s(j)
      end do
      do j = 1, 3
         do i = 1, 3
            b(i, j) = c(1 + mod(j, 3), 1 + mod(i, 3))*c(1 + mod(j + 1, 3), 1 + mod(i + 1, 3)) - &
                      c(1 + mod(j, 3), 1 + mod(i + 1, 3))*c(1 + mod(j + 1, 3), 1 + mod(i, 3))
         end do
      end do
      b = b/dot_product(c(1, :), b(:, 1))
      do j = 1, 3
         b(:, j) = s*b(:, j)*s(j)
      end do
      b = 0.5_wp*(b + transpose(b))
   end function inverse3

   !> Solution of a x = g.
   pure function solve3(a, g) result(x)
      real(wp), intent(in) :: a(3, 3), g(3)
      real(wp) :: x(3)
      real(wp) :: b(3, 3)
      b = inverse3(a)
      x = matmul(b, g)
   end function solve3

end module rockdda_interaction_liner_beam
